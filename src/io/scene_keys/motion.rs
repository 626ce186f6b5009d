//! Keys of every `[[cloud]]` that place, move, grow and texture it.

use glam::DVec3;

use super::key::keys;
use super::spec::{choice, integer, number, vector};
use crate::io::bounds::{AMOUNT, Bounds, COORDINATE, DIVISOR};
use crate::model::growth::{Growth, MAX_SCALE, MIN_SCALE};
use crate::model::gust::{Gust, MAX_WAVES};
use crate::model::texture::{Choice, MAX_STRENGTH, Texture};

keys! {
    /// Place of the cloud's origin at time 0.
    POSITION: pub fn read_position(s) -> DVec3 = "position": vector([0.0; 3], COORDINATE), "unit";
}

keys! { GUST: pub fn read_gust(s) -> Gust { Gust;
    /// Root mean square displacement of particles by gusts; 0 is calm.
    amplitude ["gust"]: number(0.0, AMOUNT), "unit";
    /// Wavelength of the largest eddy.
    length ["gust_length"]: number(4.0, DIVISOR), "unit";
    /// Period of the largest eddy.
    period_s ["gust_period_s"]: number(8.0, DIVISOR), "s";
    /// Waves that stand for the spectrum of eddies.
    n_waves ["gust_waves"]: integer(16, 1, MAX_WAVES);
}}

keys! { GROWTH: pub fn read_growth(s) -> Growth { Growth;
    /// Lengths at the end of growth over those at time 0.
    to ["grow_to"]: number(1.0, Bounds::Within(MIN_SCALE, MAX_SCALE));
    /// Time in which a share of 1 − 1/e of the way is grown.
    time_s ["grow_time_s"]: number(60.0, DIVISOR), "s";
}}

keys! { TEXTURE: pub fn read_texture(s) -> Texture { Texture;
    /// Field of the texture pool that particles are drawn with: none, one field for the whole
    /// cloud, or one by the number of the box.
    choice ["texture"]: choice("none", &Choice::NAMES);
    /// Strength s of the texture: optical depth is multiplied by exp(s n − s²⟨n²⟩/2).
    strength ["texture_strength"]: number(1.0, Bounds::Within(0.0, MAX_STRENGTH));
}}
