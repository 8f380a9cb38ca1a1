use serde::{Deserialize, Serialize};

use crate::Error;

/// How a window moves, on average.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Mean turning rate about the vertical axis, radians per pose, signed.
    pub yaw_rate: f64,
    /// Mean distance between neighbouring poses, metres per pose.
    pub speed: f64,
}

/// The classes that JEM needs and pose data does not have: a grid of turning rate and speed,
/// with edges at the quantiles of the training windows.
///
/// With 3 bins each: right, straight, left times slow, medium, fast.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manoeuvres {
    /// Edges between the bins of turning rate, ascending; one fewer than bins.
    pub yaw_rate_edges: Vec<f64>,
    /// Edges between the bins of speed, ascending; one fewer than bins.
    pub speed_edges: Vec<f64>,
}

impl Manoeuvres {
    /// Puts the edges at the quantiles `1/bins, 2/bins, ...` of the training windows' motions.
    ///
    /// Where many windows are equal (standing still), edges fall together and are kept once:
    /// there are fewer bins then.
    ///
    /// # Errors
    /// [`Error::Labels`] without motions, with fewer than 2 bins, with numbers that are not
    /// finite, or where all motions are equal so that there is one class only.
    pub fn fit(motions: &[Motion], bins: usize) -> Result<Self, Error> {
        if motions.is_empty() || bins < 2 {
            let count = motions.len();
            return Err(Error::Labels(format!("{bins} bins for {count} motions")));
        }
        if let Some(index) = motions
            .iter()
            .position(|motion| !(motion.yaw_rate.is_finite() && motion.speed.is_finite()))
        {
            return Err(Error::Labels(format!("motion {index} is not finite")));
        }
        let fitted = Self {
            yaw_rate_edges: edges(motions.iter().map(|motion| motion.yaw_rate).collect(), bins),
            speed_edges: edges(motions.iter().map(|motion| motion.speed).collect(), bins),
        };
        if fitted.classes() < 2 {
            return Err(Error::Labels("all motions are equal".to_owned()));
        }
        Ok(fitted)
    }

    /// How many classes there are.
    pub fn classes(&self) -> usize {
        (self.yaw_rate_edges.len() + 1) * (self.speed_edges.len() + 1)
    }

    /// The class of a motion, below [`classes`](Self::classes).
    pub fn label(&self, motion: Motion) -> usize {
        let yaw = self
            .yaw_rate_edges
            .partition_point(|&edge| edge <= motion.yaw_rate);
        let speed = self
            .speed_edges
            .partition_point(|&edge| edge <= motion.speed);
        yaw * (self.speed_edges.len() + 1) + speed
    }

    /// The classes of many motions.
    pub fn labels(&self, motions: &[Motion]) -> Vec<usize> {
        motions.iter().map(|&motion| self.label(motion)).collect()
    }
}

fn edges(mut values: Vec<f64>, bins: usize) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let least = values[0];
    let mut edges: Vec<f64> = (1..bins).map(|i| values[i * values.len() / bins]).collect();
    edges.dedup();
    // An edge at the smallest value would have nothing below it.
    edges.retain(|&edge| edge > least);
    edges
}
