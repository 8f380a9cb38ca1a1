use std::fmt::Debug;

use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::tensors::{NamedTensor, TensorFile};
use crate::{Init, ModelError, PairConfig, ParameterLayout, ParameterSpec, UNetConfig};

/// The shape of a network.
pub trait NetworkConfig: Clone + Debug + Send {
    /// Checks that the network can be built.
    ///
    /// # Errors
    /// [`ModelError::Config`] with the field and the rule it breaks.
    fn validate(&self) -> Result<(), ModelError>;

    /// Every parameter with name, shape and place in the flat vector; the shape is expected to be valid.
    fn layout(&self) -> ParameterLayout;
}

/// The values of one network, flat, in layout order.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters<C = UNetConfig> {
    /// The network they belong to.
    pub config: C,
    /// All values, in the order of [`NetworkConfig::layout`].
    pub values: Vec<f32>,
}

impl<C: NetworkConfig> Parameters<C> {
    /// Takes values for a network.
    ///
    /// # Errors
    /// A configuration that is not valid, the wrong number of values, or a value that is not finite.
    pub fn new(config: C, values: Vec<f32>) -> Result<Self, ModelError> {
        config.validate()?;
        check_values(&config.layout(), &values)?;
        Ok(Self { config, values })
    }

    /// Draws starting values as PyTorch does by default; the same seed gives the same values.
    ///
    /// Weights and biases of convolutions and linear layers are uniform in `+-1/sqrt(fan_in)`,
    /// normalisations start as the identity.
    ///
    /// # Errors
    /// A configuration that is not valid.
    pub fn init(config: &C, seed: u64) -> Result<Self, ModelError> {
        config.validate()?;
        Ok(Self {
            config: config.clone(),
            values: draw(&config.layout(), seed),
        })
    }

    /// Names, shapes and offsets of the values.
    pub fn layout(&self) -> ParameterLayout {
        self.config.layout()
    }

    /// The tensors, each named `prefix` and its name in `layout`, which is [`Self::layout`].
    pub fn tensors<'a>(
        &'a self,
        prefix: &'a str,
        layout: &'a ParameterLayout,
    ) -> impl Iterator<Item = NamedTensor<'a>> {
        let named = move |spec: &'a ParameterSpec| NamedTensor {
            name: format!("{prefix}{}", spec.name),
            shape: &spec.shape,
            values: &self.values[spec.range()],
        };
        layout.entries().iter().map(named)
    }

    /// Reads the tensors of [`Self::tensors`].
    ///
    /// # Errors
    /// A configuration that is not valid; a tensor that is missing, of another shape or type, or not finite.
    pub fn read(config: C, prefix: &str, file: &TensorFile<'_>) -> Result<Self, ModelError> {
        config.validate()?;
        let values = file.flat(prefix, &config.layout())?;
        Self::new(config, values)
    }
}

/// Starting values.
fn draw(layout: &ParameterLayout, seed: u64) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut values = Vec::with_capacity(layout.len());
    for spec in layout.entries() {
        let draws = (0..spec.size()).map(|_| match spec.init {
            Init::Uniform { bound } => rng.random_range(-bound..=bound),
            Init::Ones => 1.0,
            Init::Zeros => 0.0,
        });
        values.extend(draws);
    }
    values
}

/// Checks a flat vector against its layout: the length, and every value finite.
///
/// # Errors
/// [`ModelError::ParameterCount`], or [`ModelError::NotFinite`] with the parameter's name.
pub fn check_values(layout: &ParameterLayout, values: &[f32]) -> Result<(), ModelError> {
    check_count(layout, "the parameter vector", values)?;
    let Some(at) = values.iter().position(|value| !value.is_finite()) else {
        return Ok(());
    };
    let owner = layout
        .entries()
        .iter()
        .find(|spec| spec.range().contains(&at));
    let (what, index) = match owner {
        Some(spec) => (spec.name.clone(), at - spec.offset),
        None => ("the parameter vector".to_owned(), at),
    };
    Err(ModelError::NotFinite {
        what,
        index,
        value: values[at],
    })
}

/// Checks the length of a flat vector (parameters, gradient, ...) against its layout.
///
/// # Errors
/// [`ModelError::ParameterCount`].
pub fn check_count(
    layout: &ParameterLayout,
    what: &'static str,
    values: &[f32],
) -> Result<(), ModelError> {
    let (expected, found) = (layout.len(), values.len());
    if expected != found {
        return Err(ModelError::ParameterCount {
            what,
            expected,
            found,
        });
    }
    Ok(())
}

/// The values of both networks of a noise estimator.
#[derive(Clone, Debug, PartialEq)]
pub struct PairParameters {
    /// The translation network, 3 to 3 channels.
    pub translation: Parameters,
    /// The rotation network, 9 to 3 channels.
    pub rotation: Parameters,
}

impl PairParameters {
    /// Draws starting values of both networks from one seed.
    ///
    /// # Errors
    /// A configuration that is not valid.
    pub fn init(config: &PairConfig, seed: u64) -> Result<Self, ModelError> {
        config.validate()?;
        Ok(Self {
            translation: Parameters::init(&config.translation, seed)?,
            // Any fixed distance will do: the generator spreads neighbouring seeds.
            rotation: Parameters::init(&config.rotation, seed.wrapping_add(0x9E37_79B9_7F4A_7C15))?,
        })
    }

    /// The configuration of both networks.
    pub fn config(&self) -> PairConfig {
        PairConfig {
            translation: self.translation.config.clone(),
            rotation: self.rotation.config.clone(),
        }
    }
}
