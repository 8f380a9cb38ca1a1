//! The rows of every table: statistics, how they become one score, and whose network they need.

use dose3_ood::Combination;

/// Whose noise estimate a row is computed from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Network {
    /// None.
    None,
    /// The trained networks.
    Trained,
    /// Networks of the same shape as they are before training.
    Untrained,
}

/// A row.
pub struct Method {
    /// Its name in results and in the heads of columns.
    pub key: &'static str,
    /// The statistics; every block between commas gets one density where the combination is not joint.
    pub statistics: &'static str,
    /// How the blocks become one score.
    pub combination: Combination,
    /// Whose estimate.
    pub network: Network,
    /// What it is, for the legend.
    pub label: &'static str,
}

/// Index of the kinematic row, the baseline of all comparisons.
pub const KINEMATIC: usize = 0;
/// Index of the raw moments, the other baseline.
pub const MOMENTS: usize = 1;
/// Index of the differences row.
pub const DIFFERENCES: usize = 2;
/// Index of the row with the network's block.
pub const NETWORK: usize = 6;
/// Its blocks. They are functions of single windows, so that a fault can be measured by the windows around it; blocks
/// that learn from whole logs are measured with the verdicts ([`crate::verdicts`]).
const BLOCKS: &str = "kinematic,differences,residual+eps-mean";

/// Rows that are followed through logs and controls.
pub const FOLLOWED: [usize; 4] = [KINEMATIC, MOMENTS, DIFFERENCES, NETWORK];

const fn method(
    key: &'static str,
    statistics: &'static str,
    combination: Combination,
    network: Network,
    label: &'static str,
) -> Method {
    Method {
        key,
        statistics,
        combination,
        network,
        label,
    }
}

/// The rows.
pub const METHODS: [Method; 11] = [
    method(
        "kinematic",
        "kinematic",
        Combination::Joint,
        Network::None,
        "body velocity, angular rate and their differences, one density",
    ),
    method(
        "moments24",
        "moments24",
        Combination::Joint,
        Network::None,
        "raw moments of the represented window, one density",
    ),
    method(
        "differences",
        "differences",
        Combination::Joint,
        Network::None,
        "quantiles of the first and second differences of velocity and rate, one density",
    ),
    method(
        "residual",
        "residual+eps-mean",
        Combination::Joint,
        Network::Trained,
        "the network's denoising error and mean estimate alone, one density",
    ),
    method(
        "quantiles",
        "residual-quantiles",
        Combination::Joint,
        Network::Trained,
        "the network's denoising error pooled by 0.9 quantile and maximum, one density",
    ),
    method(
        "no-network",
        "kinematic,differences",
        Combination::Fisher,
        Network::None,
        "kinematic and differences, a density each, by Fisher's method",
    ),
    method(
        "network",
        BLOCKS,
        Combination::Fisher,
        Network::Trained,
        "kinematic, differences and the network's residual, a density each, by Fisher's method",
    ),
    method(
        "harmonic",
        BLOCKS,
        Combination::HarmonicMean,
        Network::Trained,
        "the same blocks by harmonic mean",
    ),
    method(
        "maximum",
        BLOCKS,
        Combination::Maximum,
        Network::Trained,
        "the same blocks by the smallest p-value",
    ),
    method(
        "joint",
        BLOCKS,
        Combination::Joint,
        Network::Trained,
        "the same columns under one density",
    ),
    method(
        "untrained",
        BLOCKS,
        Combination::Fisher,
        Network::Untrained,
        "the same with untrained networks of the same shape",
    ),
];

/// All rows.
pub fn all() -> Vec<usize> {
    (0..METHODS.len()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_name_their_rows_and_all_sets_are_known() {
        assert_eq!(METHODS[KINEMATIC].key, "kinematic");
        assert_eq!(METHODS[MOMENTS].key, "moments24");
        assert_eq!(METHODS[DIFFERENCES].key, "differences");
        assert_eq!(METHODS[NETWORK].key, "network");
        for method in &METHODS {
            let set: dose3_ood::StatisticsSet = method.statistics.parse().unwrap();
            assert_eq!(
                set.needs_trace(),
                method.network != Network::None,
                "{}",
                method.key
            );
        }
    }
}
