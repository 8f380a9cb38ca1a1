use thiserror::Error;

/// What can go wrong when a network is configured, loaded, saved or run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The configuration describes no network that can be built.
    #[error("the network configuration is not usable: {0}")]
    Config(String),

    /// A flat parameter or gradient vector has the wrong length.
    #[error("{what} has {found} values, the network has {expected} parameters")]
    ParameterCount {
        /// Which vector it is.
        what: &'static str,
        /// Length by the layout.
        expected: usize,
        /// Length found.
        found: usize,
    },

    /// A tensor handed to the network has the wrong number of values.
    #[error("{what} has {found} values, expected {expected}")]
    TensorSize {
        /// Which tensor, with its shape in words.
        what: &'static str,
        /// Number of values by the shape.
        expected: usize,
        /// Number of values found.
        found: usize,
    },

    /// The window length cannot be halved as often as the network halves it.
    #[error(
        "window length {length} is not a positive multiple of {multiple}, which a network with {levels} levels needs"
    )]
    Length {
        /// Length found.
        length: usize,
        /// What it must be a multiple of.
        multiple: usize,
        /// Levels of the network.
        levels: usize,
    },

    /// A batch without samples.
    #[error("the batch is empty")]
    EmptyBatch,

    /// NaN or infinity where a number is needed.
    #[error("{what} is not finite at index {index}: {value}")]
    NotFinite {
        /// Name of the tensor.
        what: String,
        /// Flat index within it.
        index: usize,
        /// The value found.
        value: f32,
    },

    /// A weight that half precision cannot hold.
    #[error("{name}[{index}] = {value} exceeds the range of f16 (65504): save as f32")]
    HalfOverflow {
        /// Tensor name.
        name: String,
        /// Flat index within it.
        index: usize,
        /// The value found.
        value: f32,
    },

    /// The bytes are not a safetensors file, or one cut short.
    #[error("not a readable safetensors file: {0}")]
    Safetensors(#[from] safetensors::SafeTensorError),

    /// The file says nothing (or nonsense) about the network it belongs to.
    #[error("safetensors metadata `{key}`: {reason}")]
    Metadata {
        /// Metadata key.
        key: String,
        /// What is wrong with it.
        reason: String,
    },

    /// A tensor of the configured network is not in the file.
    #[error("tensor `{0}` is missing from the file")]
    MissingTensor(String),

    /// The file holds a tensor that the configured network does not have.
    #[error("tensor `{0}` does not belong to the network that the file's configuration describes")]
    UnknownTensor(String),

    /// A tensor of the file has another shape than the configured network's.
    #[error("tensor `{name}` has shape {found:?}, expected {expected:?}")]
    TensorShape {
        /// Tensor name.
        name: String,
        /// Shape by the layout.
        expected: Vec<usize>,
        /// Shape in the file.
        found: Vec<usize>,
    },

    /// A tensor of the file is neither f32 nor f16.
    #[error("tensor `{name}` has type {found}, expected F32 or F16")]
    TensorType {
        /// Tensor name.
        name: String,
        /// Type in the file.
        found: String,
    },

    /// The requested backend is not part of this build, or does not run here.
    #[error("backend `{backend}` is not available: {reason}")]
    Backend {
        /// Backend asked for.
        backend: String,
        /// Why not, and what to do.
        reason: String,
    },

    /// The backend failed while it computed.
    #[error("the backend failed: {0}")]
    Compute(String),

    /// A parameter got no gradient from the backward pass.
    #[error("parameter `{0}` got no gradient")]
    MissingGradient(String),
}
