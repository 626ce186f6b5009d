//! The thread that draws what is edited: a frame where something has changed, of particles that
//! follow from it alone.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::error::{Error, Result};
use crate::frame::stage::DeviceChoice;
use crate::gpu::{Instance, PresentMode, Surface};
use crate::model::camera::Pose;
use crate::model::film::Film;
use crate::model::scene::Scene;
use crate::viewer::editor::acceptance::{Counted, of_statuses};
use crate::viewer::editor::scenery::Scenery;
use crate::viewer::editor::{Document, Touched};
use crate::viewer::egui_layer::SharedWidgets;
use crate::viewer::posed_player::PosedPlayer;
use crate::viewer::window_target::{PictureDraw, WindowTarget};

/// What is to be drawn.
#[derive(Debug, Clone)]
pub struct Order {
    pub document: Arc<Document>,
    pub pose: Pose,
    /// The cloud is shown; its boxes alone are not this thread's.
    pub has_cloud: bool,
    /// Of the window, in pixels.
    pub size: [u32; 2],
    /// Of the part of it that the picture fills, from its upper left corner.
    pub picture: [u32; 2],
    /// Counts the orders: another number is something to do.
    pub n: u64,
    pub quits: bool,
}

/// An order, and who waits for the next.
pub struct Orders {
    order: Mutex<Order>,
    changed: Condvar,
}

impl Orders {
    pub fn new(order: Order) -> Orders {
        Orders { order: Mutex::new(order), changed: Condvar::new() }
    }

    /// Nobody panics while it is held; if somebody did, what is in it is whole all the same.
    fn lock(&self) -> MutexGuard<'_, Order> {
        self.order.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes what is to be drawn.
    pub fn change(&self, change: impl FnOnce(&mut Order)) {
        let mut order = self.lock();
        change(&mut order);
        order.n += 1;
        self.changed.notify_one();
    }

    /// The order as soon as it is another than number `n`, or some time has passed.
    fn next(&self, n: u64) -> Order {
        let is_old = |order: &mut Order| order.n == n;
        let waited = self.changed.wait_timeout_while(self.lock(), PATIENCE, is_old);
        waited.unwrap_or_else(PoisonError::into_inner).0.clone()
    }
}

/// Somebody may want to end this without an order: Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(200);
/// So long nothing is tried where nothing of the window is seen.
const UNSEEN: Duration = Duration::from_millis(50);

/// What the thread tells the window.
#[derive(Debug)]
pub enum Told {
    /// What became of each box's particles, of this document.
    Counted(Arc<Document>, Vec<Counted>),
    /// Why the picture is not what is edited; none where it is again.
    Wrong(Option<String>),
    Ended,
}

/// What is told where nobody listens any more is lost.
pub type Tell = Box<dyn Fn(Told) + Send>;

// What lies on the device goes before the pane.
pub struct Easel {
    made: Option<Made>,
    /// The window was told so.
    is_wrong: bool,
    pane: WindowTarget,
    scenery: Scenery,
    orders: Arc<Orders>,
    face: SharedWidgets,
    tell: Tell,
    stop: &'static AtomicBool,
}

/// What is on the device of a document.
struct Made {
    showing: PictureDraw,
    player: PosedPlayer,
    document: Arc<Document>,
    /// What was drawn last.
    drawn: Option<(Arc<Document>, Pose)>,
}

impl Easel {
    pub fn new(
        surface: (Arc<Instance>, Surface),
        choice: &DeviceChoice,
        scenery: Scenery,
        (orders, face): (Arc<Orders>, SharedWidgets),
        (tell, stop): (Tell, &'static AtomicBool),
    ) -> Result<Easel> {
        let pane = WindowTarget::open(surface, choice, PresentMode::Fifo)?;
        Ok(Easel { made: None, is_wrong: false, pane, scenery, orders, face, tell, stop })
    }

    /// Draws until somebody wants no more.
    pub fn run(mut self) -> Result<()> {
        let ended = self.draw();
        self.pane.finish();
        let Easel { made, pane, .. } = self;
        drop(made);
        let closed = pane.close();
        ended.and(closed)
    }

    fn draw(&mut self) -> Result<()> {
        let mut n_done = u64::MAX;
        let mut is_whole = false;
        loop {
            let order = self.orders.next(n_done);
            if order.quits || self.stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            if is_whole && order.n == n_done {
                continue;
            }
            if !is_whole || self.pane.size() != Some(order.size) {
                self.forget();
                if !self.pane.recreate(order.size)? {
                    std::thread::sleep(UNSEEN);
                    continue;
                }
            }
            match self.follow(&order) {
                Ok(()) if std::mem::take(&mut self.is_wrong) => (self.tell)(Told::Wrong(None)),
                Ok(()) => {}
                // What does not fit is not drawn; what is edited stays.
                Err(error @ (Error::Limit { .. } | Error::Usage { .. })) => {
                    self.is_wrong = true;
                    (self.tell)(Told::Wrong(Some(error.to_string())));
                }
                Err(error) => return Err(error),
            }
            is_whole = self.show(&order)?;
            n_done = order.n;
        }
    }

    /// What was made for another size goes, once it is shown no more.
    fn forget(&mut self) {
        self.pane.finish();
        self.made = None;
    }

    /// The order's document with its picture's film.
    fn scene(&self, order: &Order) -> Arc<Scene> {
        let mut scene = self.scenery.scene(&order.document);
        let ([width, height], film) = (order.picture, scene.film);
        Arc::make_mut(&mut scene).film = Film { width, height, ..film };
        scene
    }

    /// Draws the order's document as it is seen, where either is another than it was.
    fn follow(&mut self, order: &Order) -> Result<()> {
        let is_new = self.made.is_none();
        if is_new {
            self.made = match self.make(order) {
                // Panels say why over the background alone.
                Err(error @ Error::Limit { .. }) => {
                    let seed = order.document.seed;
                    let document = Arc::new(Document { boxes: vec![], seed });
                    self.made = Some(self.make(&Order { document, ..order.clone() })?);
                    return Err(error);
                }
                made => Some(made?),
            };
        }
        let scene = self.scene(order);
        let Some(made) = &mut self.made else { return Ok(()) };
        let is_same = made.document.is_same(&order.document);
        if !is_same {
            let groups = self.scenery.groups(&Touched::between(&made.document, &order.document));
            made.player.player.reshape(&self.pane.bed, scene, &groups)?;
            made.document = order.document.clone();
        }
        if is_same && !is_new && !order.has_cloud {
            return Ok(());
        }
        let wanted = (order.document.clone(), order.pose);
        if made
            .drawn
            .as_ref()
            .is_some_and(|(document, pose)| document.is_same(&wanted.0) && *pose == wanted.1)
        {
            return Ok(());
        }
        made.player.step(0, order.pose)?;
        let renderer = &mut made.player.player.renderer;
        made.drawn = Some(wanted);
        if !is_same || is_new {
            let statuses = renderer.status(&self.pane.bed.device)?;
            let boxes = &order.document.boxes;
            let counted = of_statuses(boxes, self.scenery.statuses(boxes, &statuses));
            (self.tell)(Told::Counted(order.document.clone(), counted));
        }
        Ok(())
    }

    fn make(&self, order: &Order) -> Result<Made> {
        let player = self.pane.bed.player(self.scene(order), true)?;
        let showing = self.pane.picture_draw(&player.renderer, &player.scene.film)?;
        let showing = showing.ok_or_else(|| Error::usage("nothing of the window is seen"))?;
        let player = PosedPlayer::new(player, order.pose);
        Ok(Made { showing, player, document: order.document.clone(), drawn: None })
    }

    /// False where the window is another by now.
    fn show(&mut self, order: &Order) -> Result<bool> {
        let Some(made) = &mut self.made else { return Ok(false) };
        let is_drawn = order.has_cloud && made.drawn.is_some();
        let first = is_drawn.then_some(&mut made.player.player.renderer);
        self.pane.present(&made.showing, [first, None], None, &self.face)
    }
}
