use serde::{Deserialize, Serialize};

use crate::{ModelError, NetworkConfig, ParameterLayout};

/// More levels than this would halve any sensible window away.
const MAX_LEVELS: usize = 10;
/// A bound on every single size, so that sizes read from a file cannot overflow a product.
const MAX_SIZE: usize = 1 << 16;
/// A bound on the parameters of one network (1 GiB of f32), for the same reason.
const MAX_PARAMETERS: usize = 1 << 28;

/// The shape of one 1-D UNet (paper, section "Noise estimator"; notes on the released code).
///
/// The paper's networks have width 128 and multipliers 1, 2, 4, 8.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UNetConfig {
    /// Channels of the input: 3 for translations, 9 for flattened rotation matrices.
    pub in_channels: usize,
    /// Channels of the output: 3, a translation or a rotation tangent.
    pub out_channels: usize,
    /// Channels of the outermost level; even, at least 4, a multiple of `groups`.
    pub width: usize,
    /// Channels of each level as a multiple of `width`, outermost first.
    pub multipliers: Vec<usize>,
    /// Attention heads.
    #[serde(default = "default_heads")]
    pub heads: usize,
    /// Channels of one attention head.
    #[serde(default = "default_head_dim")]
    pub head_dim: usize,
    /// Groups of every group normalisation.
    #[serde(default = "default_groups")]
    pub groups: usize,
}

fn default_heads() -> usize {
    4
}

fn default_head_dim() -> usize {
    32
}

fn default_groups() -> usize {
    8
}

impl UNetConfig {
    /// A network with the paper's attention (4 heads of 32) and normalisation (8 groups).
    pub fn new(
        in_channels: usize,
        out_channels: usize,
        width: usize,
        multipliers: &[usize],
    ) -> Self {
        Self {
            in_channels,
            out_channels,
            width,
            multipliers: multipliers.to_vec(),
            heads: default_heads(),
            head_dim: default_head_dim(),
            groups: default_groups(),
        }
    }

    /// Checks that the network can be built.
    ///
    /// # Errors
    /// [`ModelError::Config`] with the field and the rule it breaks.
    pub fn validate(&self) -> Result<(), ModelError> {
        let sizes = [
            ("in_channels", self.in_channels),
            ("out_channels", self.out_channels),
            ("width", self.width),
            ("heads", self.heads),
            ("head_dim", self.head_dim),
            ("groups", self.groups),
        ];
        let multipliers = self.multipliers.iter().map(|&m| ("a multiplier", m));
        for (name, size) in sizes.into_iter().chain(multipliers) {
            if !(1..=MAX_SIZE).contains(&size) {
                return fail(format!("{name} is {size}, it must be 1 to {MAX_SIZE}"));
            }
        }
        if !(1..=MAX_LEVELS).contains(&self.multipliers.len()) {
            let levels = self.multipliers.len();
            return fail(format!(
                "{levels} multipliers, there must be 1 to {MAX_LEVELS}"
            ));
        }
        // The sinusoidal features divide by width / 2 - 1.
        if self.width < 4 || !self.width.is_multiple_of(2) {
            return fail(format!(
                "width is {}, it must be even and at least 4",
                self.width
            ));
        }
        if !self.width.is_multiple_of(self.groups) {
            let Self { width, groups, .. } = self;
            return fail(format!(
                "width {width} is not a multiple of the {groups} groups"
            ));
        }
        // In u128, so that the count of a hostile configuration cannot wrap.
        let count = crate::layout::count(self);
        if count > MAX_PARAMETERS as u128 {
            return fail(format!(
                "{count} parameters, at most {MAX_PARAMETERS} are allowed"
            ));
        }
        Ok(())
    }

    /// Resolution levels: the number of multipliers.
    pub fn levels(&self) -> usize {
        self.multipliers.len()
    }

    /// What the window length must be a multiple of: `2^(levels - 1)`.
    pub fn length_multiple(&self) -> usize {
        1 << self.levels().saturating_sub(1)
    }

    /// Channels along the way down: `[width, width * m0, width * m1, ...]`.
    ///
    /// Level `i` takes `dims()[i]` channels to `dims()[i + 1]`.
    pub fn dims(&self) -> Vec<usize> {
        let scaled = self.multipliers.iter().map(|m| m * self.width);
        std::iter::once(self.width).chain(scaled).collect()
    }

    /// Channels of the time embedding: four times the width.
    pub fn time_width(&self) -> usize {
        4 * self.width
    }

    /// Channels of all attention heads together.
    pub fn attention_width(&self) -> usize {
        self.heads * self.head_dim
    }

    /// Every parameter with name, shape and place in the flat vector.
    ///
    /// The configuration is expected to be valid ([`UNetConfig::validate`]).
    pub fn layout(&self) -> ParameterLayout {
        ParameterLayout::new(self)
    }

    /// Number of parameters.
    pub fn parameter_count(&self) -> usize {
        self.layout().len()
    }
}

impl NetworkConfig for UNetConfig {
    fn validate(&self) -> Result<(), ModelError> {
        self.validate()
    }

    fn layout(&self) -> ParameterLayout {
        self.layout()
    }
}

fn fail(reason: String) -> Result<(), ModelError> {
    Err(ModelError::Config(reason))
}

/// The two networks of a DOSE3 noise estimator; they share no weights.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairConfig {
    /// Noised translations `[L, 3]` to their noise `[L, 3]`.
    pub translation: UNetConfig,
    /// Noised rotation matrices `[L, 9]` (row-major) to the tangent of their noise `[L, 3]`.
    pub rotation: UNetConfig,
}

impl PairConfig {
    /// Two networks of the same width and multipliers, 3 to 3 and 9 to 3 channels.
    ///
    /// ```
    /// let paper = dose3_model::PairConfig::new(128, &[1, 2, 4, 8]);
    /// assert_eq!(paper.rotation.in_channels, 9);
    /// assert_eq!(paper.length_multiple(), 8);
    /// ```
    pub fn new(width: usize, multipliers: &[usize]) -> Self {
        Self {
            translation: UNetConfig::new(3, 3, width, multipliers),
            rotation: UNetConfig::new(9, 3, width, multipliers),
        }
    }

    /// Checks both networks, and that they have the channels of their branch.
    ///
    /// # Errors
    /// [`ModelError::Config`], naming the branch.
    pub fn validate(&self) -> Result<(), ModelError> {
        let branches = [
            ("translation", &self.translation, 3),
            ("rotation", &self.rotation, 9),
        ];
        for (branch, config, channels) in branches {
            config.validate().map_err(|error| match error {
                ModelError::Config(reason) => ModelError::Config(format!("{branch}: {reason}")),
                other => other,
            })?;
            if (config.in_channels, config.out_channels) != (channels, 3) {
                let (found, out) = (config.in_channels, config.out_channels);
                return fail(format!(
                    "{branch}: {found} to {out} channels, this branch takes {channels} to 3"
                ));
            }
        }
        Ok(())
    }

    /// What the window length must be a multiple of for both networks.
    pub fn length_multiple(&self) -> usize {
        // Both are powers of two.
        self.translation
            .length_multiple()
            .max(self.rotation.length_multiple())
    }

    /// Number of parameters of both networks together.
    pub fn parameter_count(&self) -> usize {
        self.translation.parameter_count() + self.rotation.parameter_count()
    }
}
