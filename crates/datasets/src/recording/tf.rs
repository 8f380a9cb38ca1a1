//! The tree of frames of a recording, and the pose of one frame in another over time.

use std::collections::{BTreeMap, HashSet};

use dose3_lie::{Pose, se3};

use super::message::Stamped;
use crate::stretch;

/// One frame: its parent, and where it was in it.
#[derive(Debug, Default)]
struct Edge {
    parent: String,
    /// A transform that holds at all times.
    fixed: Option<Pose>,
    /// Nanoseconds and poses, sorted by time before they are looked up.
    samples: Vec<(i64, Pose)>,
    /// The usual step between samples, seconds; `None` where there are too few.
    step: Option<f64>,
    /// One sample alone holds at all times.
    held_alone: bool,
}

/// Whether a transform holds at other times than its stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Held {
    /// Those of the static topic of ROS.
    Always,
    /// Where it is the only one of its frame: Foxglove has no topic for static transforms.
    Alone,
    Never,
}

/// Frames by their names.
#[derive(Debug, Default)]
pub(crate) struct Tree {
    edges: BTreeMap<String, Edge>,
    /// Frames that had two parents.
    reparented: HashSet<String>,
    /// Transforms that are none.
    pub unusable: usize,
}

/// Frames above each other, at most: as in tf2.
const DEEPEST: usize = 1000;
/// Frames in a listing of chains, at most: a thousand chains of ten.
const MOST_LISTED: usize = 10_000;

/// A pose looked up, and whether it does not continue the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    pub stamp: i64,
    pub pose: Pose,
    pub starts: bool,
}

/// A frame of a chain from the root of a tree.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Link {
    pub frame: String,
    /// Transforms a second; `None` for a fixed one.
    pub hertz: Option<f64>,
}

fn plain(frame: &str) -> &str {
    frame.trim_start_matches('/')
}

impl Tree {
    /// Takes one transform; `time` is that of its recording, nanoseconds, for one without a stamp.
    pub fn add(&mut self, transform: &Stamped, time: i64, held: Held) {
        let (parent, child) = (plain(&transform.parent), plain(&transform.child));
        let pose = super::pose_of(transform.position, transform.quaternion);
        let (Some(pose), false) = (
            pose,
            parent.is_empty() || child.is_empty() || parent == child,
        ) else {
            self.unusable += 1;
            return;
        };
        let edge = self.edges.entry(child.to_owned()).or_default();
        if edge.parent.is_empty() {
            parent.clone_into(&mut edge.parent);
        } else if edge.parent != parent {
            self.reparented.insert(child.to_owned());
            return;
        }
        if held == Held::Always {
            edge.fixed = Some(pose);
        } else {
            edge.held_alone = held == Held::Alone;
            edge.samples.push((transform.stamp.unwrap_or(time), pose));
        }
    }

    /// Sorts what was taken; the first of transforms with one stamp counts.
    pub fn finish(&mut self) {
        for edge in self.edges.values_mut() {
            edge.samples.sort_by_key(|(stamp, _)| *stamp);
            edge.samples.dedup_by_key(|(stamp, _)| *stamp);
            if let ([(_, pose)], true) = (&edge.samples[..], edge.held_alone) {
                edge.fixed.get_or_insert(*pose);
            }
            let stamps: Vec<i64> = edge.samples.iter().map(|(stamp, _)| *stamp).collect();
            edge.step = stretch::median_step(&stamps);
        }
    }

    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// The chain from each root to each leaf.
    pub fn chains(&self) -> Vec<Vec<Link>> {
        let parents: HashSet<&str> = self
            .edges
            .values()
            .map(|edge| edge.parent.as_str())
            .collect();
        let leaves = self
            .edges
            .keys()
            .filter(|frame| !parents.contains(frame.as_str()));
        let mut chains = Vec::new();
        let mut listed = 0;
        for leaf in leaves {
            let up = self.up(leaf);
            listed += up.len();
            if listed > MOST_LISTED {
                break;
            }
            let root = up
                .last()
                .map(|frame| self.edges[*frame].parent.clone())
                .unwrap_or_default();
            let mut chain = vec![Link {
                frame: root,
                hertz: None,
            }];
            chain.extend(up.iter().rev().map(|frame| Link {
                frame: (*frame).to_owned(),
                hertz: self.hertz(frame),
            }));
            chains.push(chain);
        }
        chains
    }

    fn hertz(&self, frame: &str) -> Option<f64> {
        let edge = self.edges.get(frame).filter(|edge| edge.fixed.is_none())?;
        edge.step.map(|step| 1.0 / step)
    }

    /// The frame and those above it, the root left out.
    fn up<'t>(&'t self, frame: &'t str) -> Vec<&'t str> {
        let mut up = Vec::new();
        let mut current = frame;
        while let Some(edge) = self.edges.get(current) {
            if up.len() == DEEPEST || up.contains(&current) {
                break;
            }
            up.push(current);
            current = &edge.parent;
        }
        up
    }

    /// Poses of `child` in `parent` at the stamps of the transform between them that comes most often, as far as all
    /// others reach, interpolated along the geodesic between their neighbours in time.
    pub fn lookup(&self, parent: &str, child: &str) -> Result<Vec<Sample>, String> {
        let (parent, child) = (plain(parent), plain(child));
        for frame in [parent, child] {
            let known = self.edges.contains_key(frame)
                || self.edges.values().any(|edge| edge.parent == frame);
            if !known {
                return Err(format!(
                    "no frame `{frame}`; there are {}",
                    self.frames().join(", ")
                ));
            }
        }
        let (down, up) = (self.up(child), self.up(parent));
        let root = |path: &[&str], frame: &str| {
            path.last()
                .map_or(frame.to_owned(), |last| self.edges[*last].parent.clone())
        };
        let (one, other) = (root(&down, child), root(&up, parent));
        if one != other {
            return Err(format!(
                "`{parent}` and `{child}` are in two trees: `{parent}` hangs below `{other}`, `{child}` below `{one}`, and nothing joins these"
            ));
        }
        // What is above both cancels.
        let shared = down
            .iter()
            .rev()
            .zip(up.iter().rev())
            .take_while(|(a, b)| a == b)
            .count();
        let down: Vec<&str> = down[..down.len() - shared].to_vec();
        let up: Vec<&str> = up[..up.len() - shared].to_vec();
        let chain: Vec<&str> = down.iter().chain(&up).copied().collect();
        if let Some(frame) = chain.iter().find(|frame| self.reparented.contains(**frame)) {
            return Err(format!(
                "the frame `{frame}` has two parents in this recording"
            ));
        }
        let moving: Vec<&str> = chain
            .iter()
            .copied()
            .filter(|frame| self.edges[*frame].fixed.is_none())
            .collect();
        let fastest = moving
            .iter()
            .max_by_key(|frame| self.edges[**frame].samples.len());
        let Some(fastest) = fastest else {
            return Err(format!(
                "all transforms between `{parent}` and `{child}` are static: nothing moves"
            ));
        };
        let start = moving
            .iter()
            .filter_map(|frame| Some(self.edges[*frame].samples.first()?.0))
            .max();
        let end = moving
            .iter()
            .filter_map(|frame| Some(self.edges[*frame].samples.last()?.0))
            .min();
        let (Some(start), Some(end)) = (start, end) else {
            return Err("a transform without a sample".to_owned());
        };
        if start > end {
            let spans: Vec<String> = moving.iter().map(|frame| self.span(frame)).collect();
            return Err(format!(
                "the transforms do not overlap in time: {}",
                spans.join(", ")
            ));
        }
        let mut samples = Vec::new();
        let mut starts = false;
        for (stamp, _) in self.edges[*fastest]
            .samples
            .iter()
            .filter(|(stamp, _)| (start..=end).contains(stamp))
        {
            let below = self.compose(&down, *stamp);
            let above = self.compose(&up, *stamp);
            match (above, below) {
                (Some(above), Some(below)) => {
                    samples.push(Sample {
                        stamp: *stamp,
                        pose: above.inverse().compose(&below),
                        starts,
                    });
                    starts = false;
                }
                _ => starts = true,
            }
        }
        Ok(samples)
    }

    fn frames(&self) -> Vec<String> {
        let mut frames: Vec<String> = self.edges.keys().cloned().collect();
        frames.extend(self.edges.values().map(|edge| edge.parent.clone()));
        frames.sort();
        frames.dedup();
        frames
    }

    fn span(&self, frame: &str) -> String {
        let samples = &self.edges[frame].samples;
        let seconds =
            |sample: Option<&(i64, Pose)>| sample.map_or(0.0, |(stamp, _)| *stamp as f64 * 1e-9);
        format!(
            "`{frame}` from {:.3} s to {:.3} s",
            seconds(samples.first()),
            seconds(samples.last())
        )
    }

    /// The pose of the first frame of a path in the parent of the last; `None` within a gap.
    fn compose(&self, path: &[&str], stamp: i64) -> Option<Pose> {
        let mut pose = Pose::identity();
        for frame in path {
            pose = self.at(frame, stamp)?.compose(&pose);
        }
        Some(pose)
    }

    /// A frame in its parent at a time within its samples.
    fn at(&self, frame: &str, stamp: i64) -> Option<Pose> {
        let edge = &self.edges[frame];
        if let Some(pose) = edge.fixed {
            return Some(pose);
        }
        let samples = &edge.samples;
        let after = samples.partition_point(|(other, _)| *other < stamp);
        let (late, next) = samples.get(after)?;
        if *late == stamp {
            return Some(*next);
        }
        let (early, last) = samples.get(after.checked_sub(1)?)?;
        let step = (late - early) as f64 * 1e-9;
        // As between poses of a log: a pause of ten usual steps and half a second is not bridged.
        let usual = edge.step.unwrap_or(0.0);
        if step > (10.0 * usual).max(0.5) {
            return None;
        }
        let share = (stamp - early) as f64 / (late - early) as f64;
        Some(se3::interpolate(last, next, share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transform(parent: &str, child: &str, seconds: f64, x: f64, yaw: f64) -> Stamped {
        Stamped {
            stamp: Some((seconds * 1e9) as i64),
            parent: parent.to_owned(),
            child: child.to_owned(),
            position: [x, 0.0, 0.0],
            quaternion: [0.0, 0.0, (yaw / 2.0).sin(), (yaw / 2.0).cos()],
        }
    }

    fn tree() -> Tree {
        let mut tree = Tree::default();
        for index in 0..11 {
            let t = f64::from(index) * 0.1;
            tree.add(
                &transform("/odom", "base_link", t, t, 0.1 * t),
                0,
                Held::Never,
            );
        }
        for index in 0..3 {
            let t = f64::from(index) * 0.5;
            tree.add(&transform("map", "odom", t, 10.0 + t, 0.0), 0, Held::Never);
        }
        tree.add(
            &transform("base_link", "camera", 0.0, 0.5, 0.0),
            0,
            Held::Always,
        );
        tree.add(
            &transform("elsewhere", "other", 0.0, 0.5, 0.0),
            0,
            Held::Never,
        );
        tree.finish();
        tree
    }

    #[test]
    fn chains_are_interpolated_and_inverted() {
        let tree = tree();
        let poses = tree.lookup("map", "camera").unwrap();
        assert_eq!(poses.len(), 11);
        for (index, sample) in poses.iter().enumerate() {
            let t = index as f64 * 0.1;
            let expected = 10.0 + 2.0 * t + 0.5 * (0.1 * t).cos();
            assert!(
                (sample.pose.translation.x - expected).abs() < 1e-9,
                "{index}"
            );
        }
        let back = tree.lookup("camera", "map").unwrap();
        let whole = back[7].pose.compose(&poses[7].pose);
        assert!(whole.translation.norm() < 1e-9);
        // Frames beside each other: what is above both cancels.
        let own = tree.lookup("odom", "base_link").unwrap();
        assert!((own[3].pose.translation.x - 0.3).abs() < 1e-12);
        let names: Vec<String> = tree.chains()[0]
            .iter()
            .map(|link| link.frame.clone())
            .collect();
        assert_eq!(names, ["map", "odom", "base_link", "camera"]);
    }

    #[test]
    fn a_listing_of_chains_has_an_end() {
        let mut tree = Tree::default();
        for index in 0..600 {
            let (parent, child) = (format!("f{index}"), format!("f{}", index + 1));
            tree.add(&transform(&parent, &child, 0.0, 1.0, 0.0), 0, Held::Always);
            let leaf = format!("leaf{index}");
            tree.add(&transform("f600", &leaf, 0.0, 1.0, 0.0), 0, Held::Always);
        }
        tree.finish();
        let listed: usize = tree.chains().iter().map(Vec::len).sum();
        assert!((5_000..=10_100).contains(&listed), "{listed}");
    }

    #[test]
    fn a_lone_transform_of_foxglove_holds_and_two_do_not() {
        let mut tree = Tree::default();
        for index in 0..5 {
            let t = f64::from(index);
            tree.add(&transform("odom", "body", t, t, 0.0), 0, Held::Alone);
        }
        tree.add(&transform("map", "odom", 2.0, 10.0, 0.0), 0, Held::Alone);
        tree.finish();
        assert_eq!(tree.lookup("map", "body").unwrap().len(), 5);
        let mut again = Tree::default();
        for t in [2.0, 3.0] {
            again.add(&transform("map", "odom", t, 10.0, 0.0), 0, Held::Alone);
        }
        for index in 0..5 {
            let t = f64::from(index);
            again.add(&transform("odom", "body", t, t, 0.0), 0, Held::Alone);
        }
        again.finish();
        assert_eq!(again.lookup("map", "body").unwrap().len(), 2);
    }

    #[test]
    fn broken_chains_are_named() {
        let mut tree = tree();
        let reason = |tree: &Tree, a, b| tree.lookup(a, b).unwrap_err();
        assert!(
            reason(&tree, "map", "nowhere")
                .contains("no frame `nowhere`; there are base_link, camera")
        );
        assert!(reason(&tree, "map", "other").contains("two trees"));
        assert!(reason(&tree, "base_link", "camera").contains("static"));
        tree.add(&transform("camera", "late", 50.0, 0.0, 0.0), 0, Held::Never);
        tree.finish();
        assert!(reason(&tree, "map", "late").contains("do not overlap"));
        tree.add(&transform("world", "odom", 0.2, 0.0, 0.0), 0, Held::Never);
        assert!(reason(&tree, "map", "base_link").contains("two parents"));
        // A pause is not bridged.
        let mut paused = Tree::default();
        for t in [0.0, 0.1, 0.2, 5.0, 5.1] {
            paused.add(&transform("a", "b", t, t, 0.0), 0, Held::Never);
        }
        for index in 0..52 {
            paused.add(
                &transform("b", "c", f64::from(index) * 0.1, 0.0, 0.0),
                0,
                Held::Never,
            );
        }
        paused.finish();
        let samples = paused.lookup("a", "c").unwrap();
        assert!(samples.len() < 10);
        assert_eq!(samples.iter().filter(|sample| sample.starts).count(), 1);
    }
}
