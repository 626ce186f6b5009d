//! Documents and actions, generated: the usual, and all that a file takes and what it does not.

use glam::DVec3;
use nimbus::model::boxes::CloudBox;
use nimbus::viewer::editor::action::Modifiers;
use nimbus::viewer::editor::handles::{Handle, Side};
use nimbus::viewer::editor::mirror::{Outcome, Plane};
use nimbus::viewer::editor::ray::Ray;
use nimbus::viewer::editor::selection::How;
use nimbus::viewer::editor::snap::Snap;
use nimbus::viewer::editor::state::{Scaling, View};
use nimbus::viewer::editor::{Action, Axis, DragAction, Edit, Select, Setting};
use proptest::collection::vec;
use proptest::prelude::*;

pub fn select(boxes: Vec<usize>) -> Action {
    Action::Select(Select::Boxes { boxes, how: How::Replace })
}

/// What a file takes: places to 1e15, edges of 0 or from 1e-30 on.
fn coordinate() -> BoxedStrategy<f64> {
    prop_oneof![6 => -9.0..9.0, 1 => Just(0.0), 1 => Just(-0.0), 1 => -1e15..1e15, 1 => Just(6.12438e-7)].boxed()
}

fn edge() -> BoxedStrategy<f64> {
    prop_oneof![6 => 0.1..8.0, 1 => Just(0.0), 1 => Just(1e-30), 1 => Just(1e15)].boxed()
}

/// And anything at all.
fn wild() -> BoxedStrategy<f64> {
    let ends =
        [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, 1e-31, 1e15, -1e15, f64::MIN_POSITIVE];
    prop_oneof![6 => -9.0..9.0, 2 => prop::sample::select(ends.to_vec()), 1 => any::<f64>(), 1 => Just(0.0)].boxed()
}

type Number = fn() -> BoxedStrategy<f64>;

fn vector(of: Number) -> impl Strategy<Value = DVec3> {
    [of(), of(), of()].prop_map(DVec3::from_array)
}

fn cloud_box(edge: Number, coordinate: Number) -> impl Strategy<Value = CloudBox> {
    let count = prop_oneof![8 => 0..300u32, 1 => any::<u32>()];
    let numbers = (count, vector(edge), vector(coordinate), edge());
    numbers.prop_map(|(n_particles, extent, center, radius_max)| CloudBox {
        n_particles,
        extent,
        center,
        radius_max,
    })
}

pub fn boxes() -> impl Strategy<Value = Vec<CloudBox>> {
    vec(cloud_box(edge, coordinate), 0..8)
}

/// Within some ten units, none of them flat.
pub fn usual_boxes() -> impl Strategy<Value = Vec<CloudBox>> {
    vec(
        cloud_box(|| (0.1..8.0).boxed(), || prop_oneof![8 => -9.0..9.0, 1 => Just(0.0)].boxed()),
        0..8,
    )
}

fn axis() -> impl Strategy<Value = Axis> {
    prop::sample::select(Axis::ALL.to_vec())
}

fn edit(n: Number) -> impl Strategy<Value = Edit> {
    prop_oneof![
        2 => cloud_box(n, n).prop_map(Edit::Add),
        1 => cloud_box(edge, coordinate).prop_map(Edit::Add),
        2 => Just(Edit::Duplicate),
        1 => Just(Edit::Delete),
        1 => any::<u32>().prop_map(Edit::Count),
        1 => n().prop_map(Edit::Density),
        2 => (axis(), n()).prop_map(|(axis, v)| Edit::Extent(axis, v)),
        2 => (axis(), n()).prop_map(|(axis, v)| Edit::Center(axis, v)),
        1 => n().prop_map(Edit::Radius),
        2 => vector(n).prop_map(Edit::MoveBy),
        2 => vector(n).prop_map(Edit::ScaleBy),
        3 => mirror(),
        1 => Just(Edit::SnapToGrid),
        1 => (0..4u32).prop_map(Edit::Seed),
    ]
}

fn mirror() -> impl Strategy<Value = Edit> {
    let plane = prop_oneof![Just(Plane::Zero), Just(Plane::Middle)];
    let outcome = prop_oneof![Just(Outcome::Move), Just(Outcome::Copy)];
    (axis(), plane, outcome).prop_map(|(axis, plane, outcome)| Edit::Mirror {
        axis,
        plane,
        outcome,
    })
}

fn selection() -> impl Strategy<Value = Select> {
    let how = prop_oneof![2 => Just(How::Replace), 2 => Just(How::Add), 1 => Just(How::Toggle), 1 => Just(How::Remove)];
    prop_oneof![
        4 => (vec(0..10usize, 0..4), how).prop_map(|(boxes, how)| Select::Boxes { boxes, how }),
        4 => Just(Select::All),
        1 => Just(Select::None),
        1 => Just(Select::Next),
        1 => Just(Select::Previous),
    ]
}

fn setting() -> impl Strategy<Value = Setting> {
    prop_oneof![
        (any::<bool>(), prop_oneof![Just(0.1), 0.01..2.0, wild()])
            .prop_map(|(on, step)| Setting::Snap(Snap { on, step })),
        prop_oneof![Just(Scaling::Symmetric), Just(Scaling::OppositeFace)]
            .prop_map(Setting::Scaling),
        prop_oneof![Just(View::Boxes), Just(View::Cloud), Just(View::Both)].prop_map(Setting::View),
        axis().prop_map(Setting::Axis),
    ]
}

/// Towards the middle of things, more or less; seldom anywhere.
fn ray() -> impl Strategy<Value = Ray> {
    let usual = (-6.0..6.0, -6.0..6.0, -0.5..0.5, -0.5..0.5).prop_map(|(x, y, dx, dy)| Ray {
        origin: DVec3::new(x, y, 20.0),
        direction: DVec3::new(dx, dy, -1.0).normalize(),
    });
    let any =
        (vector(wild), vector(wild)).prop_map(|(origin, direction)| Ray { origin, direction });
    prop_oneof![12 => usual, 1 => any]
}

fn handle() -> impl Strategy<Value = Handle> {
    let side = prop_oneof![Just(Side::Low), Just(Side::High)];
    prop_oneof![
        axis().prop_map(Handle::MoveAxis),
        Just(Handle::MoveView),
        (axis(), side).prop_map(|(axis, side)| Handle::ScaleFace(axis, side)),
        Just(Handle::ScaleAll),
        axis().prop_map(Handle::ScaleAxis),
    ]
}

pub fn begin() -> impl Strategy<Value = Action> {
    let begin = (handle(), ray()).prop_map(|(handle, ray)| DragAction::Begin {
        handle,
        ray,
        forward: -DVec3::Z,
    });
    begin.prop_map(Action::Drag)
}

pub fn drag_to() -> impl Strategy<Value = Action> {
    let modifiers =
        (any::<bool>(), any::<bool>()).prop_map(|(snap, scaling)| Modifiers { snap, scaling });
    (ray(), modifiers).prop_map(|(ray, modifiers)| Action::Drag(DragAction::To { ray, modifiers }))
}

fn drag() -> impl Strategy<Value = Action> {
    prop_oneof![
        3 => begin(),
        4 => drag_to(),
        1 => axis().prop_map(|axis| Action::Drag(DragAction::Constrain(axis))),
        6 => Just(Action::Drag(DragAction::End)),
        1 => Just(Action::Drag(DragAction::Cancel)),
    ]
}

pub fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        4 => edit(wild).prop_map(Action::Edit),
        6 => edit(|| (0.2..4.0).boxed()).prop_map(Action::Edit),
        4 => selection().prop_map(Action::Select),
        6 => drag(),
        1 => Just(Action::Undo),
        1 => Just(Action::Redo),
        1 => setting().prop_map(Action::Set),
    ]
}

/// Few different ones, so that a way back is met by chance as well.
pub fn small_action() -> impl Strategy<Value = Action> {
    let one = |v: f64| prop_oneof![Just(v), Just(-v)];
    prop_oneof![
        2 => Just(Action::Select(Select::All)),
        3 => one(1.0).prop_map(|v| Action::Edit(Edit::MoveBy(DVec3::X * v))),
        2 => mirror().prop_map(Action::Edit),
        1 => Just(Action::Edit(Edit::Duplicate)),
        1 => Just(Action::Edit(Edit::Delete)),
        2 => (1..3u32).prop_map(|n| Action::Edit(Edit::Count(n))),
        1 => (1..3u32).prop_map(|n| Action::Edit(Edit::Seed(n))),
        4 => Just(Action::Undo),
        2 => Just(Action::Redo),
        1 => begin(),
        2 => drag_to(),
        3 => Just(Action::Drag(DragAction::End)),
        1 => Just(Action::Drag(DragAction::Cancel)),
    ]
}
