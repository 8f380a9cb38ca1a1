//! Sets of statistics: unions of named members.

use super::statistic::{Source, Statistic};
use super::{JointErrors, LinearPredictor, PoseWindow, Trace, TraceSummary, Workspace};
use crate::error::{Error, expect_finite};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// A non-empty union of statistics, written `residual+change`, or several in blocks of their own,
/// `kinematic,residual+change`, whose p-values are combined, or blocks in several tests,
/// `kinematic,differences/residual+change`, each with a share of alpha of its own. Its columns come in the
/// order of its members. Serialised as that text.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct StatisticsSet {
    members: Vec<Statistic>,
    /// Numbers of members of the blocks; they add up to the members.
    blocks: Vec<usize>,
    /// Numbers of blocks of the tests; they add up to the blocks.
    tests: Vec<usize>,
}

/// Columns of a set that belong together, such as the statistics of one rotation axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    /// `member.part`, for example `paper24.rotation_z`.
    pub name: String,
    /// Indices into the vector of statistics.
    pub columns: Vec<usize>,
}

/// Everything that can be known of one window. What a set does not need may be left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample<'a> {
    /// One summary per noise draw; the statistics are averaged over them.
    pub traces: &'a [TraceSummary],
    /// The represented poses, for `moments24`.
    pub window: Option<PoseWindow<'a>>,
    /// `[n, 6]` body-frame increments between consecutive poses (log of `T_i^-1 T_{i+1}`:
    /// translation x, y, z in metres, rotation tangent x, y, z in radians), for `kinematic`.
    pub increments: Option<&'a [f64]>,
    /// What `lin` predicts each axis with: that of the detector, or for trusted logs the one that has not seen
    /// their group ([`LinearReference::without`](super::LinearReference::without)).
    pub linear: Option<&'a LinearPredictor>,
    /// What the joint network got wrong, for `joint` and its like.
    pub joint: Option<&'a JointErrors>,
}

impl StatisticsSet {
    /// A union of members.
    ///
    /// # Errors
    /// [`Error::EmptySet`] for none, [`Error::Overlap`] where two members compute the same column
    /// (`paper24+r3`, or a member twice): a repeated column makes every covariance singular.
    pub fn new(members: impl Into<Vec<Statistic>>) -> Result<Self, Error> {
        let members = members.into();
        if members.is_empty() {
            return Err(Error::EmptySet);
        }
        let mut seen: HashMap<String, Statistic> = HashMap::new();
        for &member in &members {
            for column in member.columns() {
                if let Some(first) = seen.insert(column.name.clone(), member) {
                    return Err(Error::Overlap {
                        first,
                        second: member,
                        column: column.name,
                    });
                }
            }
        }
        let blocks = vec![members.len()];
        let tests = vec![1];
        Ok(Self {
            members,
            blocks,
            tests,
        })
    }

    /// Blocks of members: each is to have a density of its own.
    ///
    /// # Errors
    /// As [`new`](Self::new), for a block without members too.
    pub fn in_blocks(blocks: &[Vec<Statistic>]) -> Result<Self, Error> {
        Self::in_tests(&[blocks.to_vec()])
    }

    /// Tests of blocks of members: each test is to have a share of alpha of its own.
    ///
    /// # Errors
    /// As [`in_blocks`](Self::in_blocks), for a test without blocks too.
    pub fn in_tests(tests: &[Vec<Vec<Statistic>>]) -> Result<Self, Error> {
        let blocks = tests.concat();
        if tests.iter().any(Vec::is_empty) || blocks.iter().any(Vec::is_empty) {
            return Err(Error::EmptySet);
        }
        Ok(Self {
            blocks: blocks.iter().map(Vec::len).collect(),
            tests: tests.iter().map(Vec::len).collect(),
            ..Self::new(blocks.concat())?
        })
    }

    /// How many tests it has; 1 where nothing is said of tests.
    #[must_use]
    pub fn tests(&self) -> usize {
        self.tests.len()
    }

    /// Names of the tests: their blocks, joined by a comma.
    #[must_use]
    pub fn test_names(&self) -> Vec<String> {
        let blocks: Vec<String> = self.block_members().map(joined).collect();
        let named = self.test_blocks().into_iter();
        named.map(|test| blocks[test].join(",")).collect()
    }

    /// The [`groups`](Self::groups) of each test.
    #[must_use]
    pub fn test_groups(&self) -> Vec<Range<usize>> {
        match self.blocks() {
            1 => std::iter::once(0..self.groups().len()).collect(),
            _ => self.test_blocks(),
        }
    }

    fn test_blocks(&self) -> Vec<Range<usize>> {
        let mut next = 0;
        let ranges = self.tests.iter().map(|&blocks| {
            next += blocks;
            next - blocks..next
        });
        ranges.collect()
    }

    /// How many blocks it has, of all tests; 1 for a plain union.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// The members, in order.
    #[must_use]
    pub fn members(&self) -> &[Statistic] {
        &self.members
    }

    /// How many numbers the set computes.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.members.iter().map(|m| m.columns().len()).sum()
    }

    /// Names of the columns, all different.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let columns = self.members.iter().flat_map(|m| m.columns());
        columns.map(|c| c.name).collect()
    }

    /// The groups; every column is in exactly one. Several blocks are the groups themselves; those of a
    /// plain union are the parts of its members.
    #[must_use]
    pub fn groups(&self) -> Vec<Group> {
        if self.blocks() > 1 {
            return self.block_groups();
        }
        let mut groups: Vec<Group> = Vec::new();
        let mut index = 0;
        for member in &self.members {
            for column in member.columns() {
                let name = format!("{member}.{}", column.part);
                match groups.iter_mut().find(|g| g.name == name) {
                    Some(group) => group.columns.push(index),
                    None => groups.push(Group {
                        name,
                        columns: vec![index],
                    }),
                }
                index += 1;
            }
        }
        groups
    }

    fn block_groups(&self) -> Vec<Group> {
        let mut next = 0;
        self.block_members()
            .map(|members| {
                let start = next;
                next += members.iter().map(|m| m.columns().len()).sum::<usize>();
                Group {
                    name: joined(members),
                    columns: (start..next).collect(),
                }
            })
            .collect()
    }

    fn block_members(&self) -> impl Iterator<Item = &[Statistic]> {
        self.blocks.iter().scan(0, |start, &length| {
            let members = &self.members[*start..*start + length];
            *start += length;
            Some(members)
        })
    }

    /// Whether [`Sample::traces`] is needed, that is, a noise estimator.
    #[must_use]
    pub fn needs_trace(&self) -> bool {
        self.needs(Source::Trace)
    }

    /// Whether the traces must hold the rotation branch.
    #[must_use]
    pub fn needs_rotation_trace(&self) -> bool {
        let rotation = |m: &Statistic| m.source() == Source::Trace && *m != Statistic::R3;
        self.members.iter().any(rotation)
    }

    /// Whether the traces must hold drawn noise: a denoising error has none to be measured from on a
    /// deterministic path.
    #[must_use]
    pub fn needs_noise(&self) -> bool {
        let denoises =
            |m: &Statistic| matches!(m, Statistic::Residual | Statistic::ResidualQuantiles);
        self.members.iter().any(denoises)
    }

    /// Whether [`Sample::window`] is needed.
    #[must_use]
    pub fn needs_window(&self) -> bool {
        self.needs(Source::Poses)
    }

    /// Whether [`Sample::increments`] is needed.
    #[must_use]
    pub fn needs_increments(&self) -> bool {
        self.needs(Source::Increments)
    }

    /// Whether [`Sample::joint`] is needed: the joint network, and the scale of the trusted logs.
    #[must_use]
    pub fn needs_joint(&self) -> bool {
        self.needs(Source::Joint)
    }

    /// Whether [`Sample::linear`] is needed: a state fitted to trusted logs, beside their densities.
    #[must_use]
    pub fn needs_linear(&self) -> bool {
        self.members.contains(&Statistic::Lin)
    }

    fn needs(&self, source: Source) -> bool {
        self.members.iter().any(|m| m.source() == source)
    }

    /// The statistics of one window, in the order of [`names`](Self::names).
    ///
    /// # Errors
    /// [`Error::MissingInput`], [`Error::TooFewSteps`], [`Error::Shape`]; [`Error::NotFinite`] where
    /// a result is NaN or infinite.
    pub fn evaluate(&self, sample: &Sample<'_>) -> Result<Vec<f64>, Error> {
        let mut values = Vec::with_capacity(self.dimension());
        self.evaluate_into(sample, &mut Workspace::default(), &mut values)?;
        Ok(values)
    }

    /// As [`evaluate`](Self::evaluate), in the place of what `out` held. Statistics of increments allocate nothing
    /// once workspace and row have been used for a window as long.
    ///
    /// # Errors
    /// As [`evaluate`](Self::evaluate).
    pub fn evaluate_into(
        &self,
        sample: &Sample<'_>,
        work: &mut Workspace,
        out: &mut Vec<f64>,
    ) -> Result<(), Error> {
        out.clear();
        for member in &self.members {
            member.values(sample, work, out)?;
        }
        expect_finite("a vector of statistics", &*out)
    }

    /// [`evaluate`](Self::evaluate) for one stored trace.
    ///
    /// # Errors
    /// As [`evaluate`](Self::evaluate) and [`TraceSummary::of`].
    pub fn compute(&self, trace: &Trace<'_>) -> Result<Vec<f64>, Error> {
        let summary = TraceSummary::of(trace)?;
        self.evaluate(&Sample {
            traces: std::slice::from_ref(&summary),
            ..Sample::default()
        })
    }
}

impl From<Statistic> for StatisticsSet {
    fn from(member: Statistic) -> Self {
        Self {
            members: vec![member],
            blocks: vec![1],
            tests: vec![1],
        }
    }
}

impl fmt::Display for StatisticsSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.test_names().join("/"))
    }
}

/// `residual+change`.
fn joined(members: &[Statistic]) -> String {
    let names: Vec<&str> = members.iter().map(|m| m.name()).collect();
    names.join("+")
}

impl FromStr for StatisticsSet {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let block = |text: &str| -> Result<Vec<Statistic>, Error> {
            if text.trim().is_empty() {
                return Err(Error::EmptySet);
            }
            text.split('+').map(str::parse).collect()
        };
        let test = |text: &str| text.split(',').map(block).collect::<Result<Vec<_>, _>>();
        let tests: Result<Vec<_>, _> = text.split('/').map(test).collect();
        Self::in_tests(&tests?)
    }
}

impl TryFrom<String> for StatisticsSet {
    type Error = Error;

    fn try_from(text: String) -> Result<Self, Error> {
        text.parse()
    }
}

impl From<StatisticsSet> for String {
    fn from(set: StatisticsSet) -> Self {
        set.to_string()
    }
}
