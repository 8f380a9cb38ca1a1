//! Increments as twists: the translation seen from half-way through the turn.
//!
//! An increment's translation is in the axes of the pose that it starts from. While the body turns by `w`, a
//! step straight ahead then has a sideways part of about `w / 2` of its length, in one direction forward in
//! time and in the other backward. Half-way through the turn, `u = exp(-w / 2) v`, it has none.

use super::trace::CHANNELS;
use crate::error::{Error, expect_finite, expect_len};
use nalgebra::{UnitQuaternion, Vector3};

/// One step: translation x, y, z in metres, seen from half-way, then the rotation tangent x, y, z in radians.
pub type Twist = [f64; CHANNELS];

/// No platform moves by as much in one pose; products of larger numbers overflow.
const LARGEST: f64 = 1e100;

/// Of `[n, 6]` body-frame increments. Numbers beyond 1e100 count as that.
///
/// # Errors
/// [`Error::Shape`] where they are no multiple of six numbers, [`Error::NotFinite`].
pub fn halfway(increments: &[f64]) -> Result<Vec<Twist>, Error> {
    let mut twists = Vec::new();
    halfway_into(increments, &mut twists)?;
    Ok(twists)
}

/// As [`halfway`], in the place of what `out` held.
pub(crate) fn halfway_into(increments: &[f64], out: &mut Vec<Twist>) -> Result<(), Error> {
    out.clear();
    let length = increments.len() / CHANNELS;
    expect_len("body-frame increments", length * CHANNELS, increments.len())?;
    expect_finite("body-frame increments", increments)?;
    out.extend(increments.chunks_exact(CHANNELS).map(twist));
    Ok(())
}

fn twist(step: &[f64]) -> Twist {
    let at = |axis: usize| step[axis].clamp(-LARGEST, LARGEST);
    let translation = Vector3::new(at(0), at(1), at(2));
    let turn = Vector3::new(at(3), at(4), at(5));
    let u = UnitQuaternion::from_scaled_axis(-0.5 * turn) * translation;
    [u.x, u.y, u.z, turn.x, turn.y, turn.z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_has_no_sideways_part() {
        // A circle of radius 5 m, 0.2 rad a step: the chord is 10 sin(0.1) long, 0.1 rad to the left.
        let chord = 10.0 * 0.1_f64.sin();
        let step = [
            chord * 0.1_f64.cos(),
            chord * 0.1_f64.sin(),
            0.,
            0.,
            0.,
            0.2,
        ];
        let u = halfway(&step).unwrap()[0];
        assert!((u[0] - chord).abs() < 1e-12 && u[1].abs() < 1e-12, "{u:?}");
        assert_eq!(u[5], 0.2);
        assert_eq!(
            halfway(&[1., 2., 3., 0., 0., 0.]).unwrap()[0],
            [1., 2., 3., 0., 0., 0.]
        );
        assert!(halfway(&step[..5]).is_err());
        assert!(halfway(&[f64::NAN; 6]).is_err());
    }
}
