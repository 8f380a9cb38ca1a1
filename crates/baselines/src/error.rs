use thiserror::Error;

/// What can go wrong in training, scoring, reading and writing a baseline.
#[derive(Debug, Error)]
pub enum Error {
    /// The data cannot be cut into windows of the stated shape.
    #[error("{found} numbers are no windows of {length} poses with {channels} channels")]
    Shape {
        /// Numbers given.
        found: usize,
        /// Stated window length.
        length: usize,
        /// Stated channels.
        channels: usize,
    },
    /// There is no window at all.
    #[error("there are no windows")]
    Empty,
    /// A number that is NaN or infinite.
    #[error("{what}: value {value} at index {index} is not finite")]
    NotFinite {
        /// Where.
        what: String,
        /// Which number.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// Windows of another shape than those trained on.
    #[error(
        "trained on windows of {expected_length} poses with {expected_channels} channels, \
         given {length} poses with {channels} channels"
    )]
    OtherShape {
        /// Window length of the training data.
        expected_length: usize,
        /// Channels of the training data.
        expected_channels: usize,
        /// Window length given.
        length: usize,
        /// Channels given.
        channels: usize,
    },
    /// A configuration that cannot work, and why.
    #[error("configuration: {0}")]
    Config(String),
    /// Labels that do not fit the windows or the classes.
    #[error("labels: {0}")]
    Labels(String),
    /// The likelihood of a Glow stopped being a number in training.
    #[error("{stage}: the loss at step {step} is not finite")]
    Diverged {
        /// `glow` or `background`.
        stage: &'static str,
        /// The training step, from 0.
        step: usize,
    },
    /// A mixing matrix that cannot be inverted.
    #[error("the invertible convolution's matrix is singular")]
    Singular,
    /// A failure inside burn.
    #[error("burn: {0}")]
    Compute(String),
    /// Bytes that are no safetensors file, and tensors that cannot be stored or read.
    #[error("weights: {0}")]
    Weights(#[from] dose3_model::ModelError),
    /// A header that is missing, of another kind or version, or not valid.
    #[error("weights header: {0}")]
    Header(String),
    /// A tensor that is missing, unknown, or of another shape or type.
    #[error("weights: tensor `{name}`: {reason}")]
    Tensor {
        /// The tensor's name.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
}
