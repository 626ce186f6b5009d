//! Generated documents and actions: usual ones, all that a file can hold, and invalid ones.

use glam::DVec3;
use nimbus::model::boxes::CloudBox;
use nimbus::viewer::editor::{
    Action, Axis, DisplayMode, DragAction, DragModifiers, Edit, GridSnap, Handle, MirrorPlane,
    MirrorResult, Ray, ScalingAnchor, Select, SelectionMode, Setting, Side,
};
use proptest::collection::vec;
use proptest::prelude::*;

pub fn select(boxes: Vec<usize>) -> Action {
    Action::Select(Select::Boxes { boxes, mode: SelectionMode::Replace })
}

/// Returns a coordinate that a file can hold: up to 1e15.
fn coordinate() -> BoxedStrategy<f64> {
    prop_oneof![
        6 => -9.0..9.0,
        1 => Just(0.0),
        1 => Just(-0.0),
        1 => -1e15..1e15,
        1 => Just(6.12438e-7),
    ]
    .boxed()
}

/// Returns an extent that a file can hold: 0, or from 1e-30 on.
fn edge() -> BoxedStrategy<f64> {
    prop_oneof![6 => 0.1..8.0, 1 => Just(0.0), 1 => Just(1e-30), 1 => Just(1e15)].boxed()
}

/// Returns any number.
fn wild() -> BoxedStrategy<f64> {
    let ends =
        [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, 1e-31, 1e15, -1e15, f64::MIN_POSITIVE];
    prop_oneof![
        6 => -9.0..9.0,
        2 => prop::sample::select(ends.to_vec()),
        1 => any::<f64>(),
        1 => Just(0.0),
    ]
    .boxed()
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

/// Returns boxes within ten units, none of them flat.
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
        3 => mirror(),
        1 => (0..4u32).prop_map(Edit::Seed),
    ]
}

fn mirror() -> impl Strategy<Value = Edit> {
    let plane = prop_oneof![Just(MirrorPlane::Zero), Just(MirrorPlane::Middle)];
    let result = prop_oneof![Just(MirrorResult::Move), Just(MirrorResult::Copy)];
    (axis(), plane, result).prop_map(|(axis, plane, result)| Edit::Mirror { axis, plane, result })
}

fn selection() -> impl Strategy<Value = Select> {
    let mode = prop_oneof![
        2 => Just(SelectionMode::Replace),
        2 => Just(SelectionMode::Add),
        1 => Just(SelectionMode::Toggle),
        1 => Just(SelectionMode::Remove),
    ];
    prop_oneof![
        4 => (vec(0..10usize, 0..4), mode).prop_map(|(boxes, mode)| Select::Boxes { boxes, mode }),
        4 => Just(Select::All),
        1 => Just(Select::None),
        1 => Just(Select::Next),
        1 => Just(Select::Previous),
    ]
}

fn setting() -> impl Strategy<Value = Setting> {
    prop_oneof![
        (any::<bool>(), prop_oneof![Just(0.1), 0.01..2.0, wild()])
            .prop_map(|(is_on, step)| Setting::Snap(GridSnap { is_on, step })),
        prop_oneof![Just(ScalingAnchor::Center), Just(ScalingAnchor::OppositeFace)]
            .prop_map(Setting::Anchor),
        prop_oneof![Just(DisplayMode::Boxes), Just(DisplayMode::Cloud), Just(DisplayMode::Both)]
            .prop_map(Setting::Display),
        axis().prop_map(Setting::Axis),
    ]
}

/// Returns a ray, mostly toward the boxes.
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
        (any::<bool>(), any::<bool>()).prop_map(|(snap, anchor)| DragModifiers { snap, anchor });
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

/// Returns one of few actions, so that a sequence may return to an earlier document.
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
