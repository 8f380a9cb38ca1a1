use std::fmt;
use std::str::FromStr;

use burn::tensor::Device;

use crate::ModelError;

/// Where burn computes. Each needs the crate feature of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// burn-flex: pure Rust on the CPU, the default.
    Flex,
    /// burn-ndarray: the older CPU backend, kept to check the other; several times slower.
    Ndarray,
    /// Any GPU that wgpu finds (Vulkan, Metal, DirectX 12).
    Wgpu,
}

impl Backend {
    /// All backends, compiled in or not.
    pub const ALL: [Self; 3] = [Self::Flex, Self::Ndarray, Self::Wgpu];

    /// The backend's name, which is also its crate feature.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flex => "flex",
            Self::Ndarray => "ndarray",
            Self::Wgpu => "wgpu",
        }
    }

    /// Whether this build holds the backend.
    pub fn is_compiled(self) -> bool {
        match self {
            Self::Flex => cfg!(feature = "flex"),
            Self::Ndarray => cfg!(feature = "ndarray"),
            Self::Wgpu => cfg!(feature = "wgpu"),
        }
    }

    /// The backend's default device, without autodiff.
    ///
    /// # Errors
    /// [`ModelError::Backend`] if it is not compiled in, or if there is no such device here.
    pub fn device(self) -> Result<Device, ModelError> {
        match self {
            #[cfg(feature = "flex")]
            Self::Flex => Ok(Device::flex()),
            #[cfg(feature = "ndarray")]
            #[allow(deprecated)]
            // upstream deprecates the backend; it stays as a cross-check
            Self::Ndarray => Ok(Device::ndarray()),
            #[cfg(feature = "wgpu")]
            Self::Wgpu => probe(self, || {
                Device::wgpu(burn::tensor::DeviceKind::DefaultDevice)
            }),
            #[allow(unreachable_patterns)] // with every feature there is no other
            _ => {
                let reason = format!("not part of this build: build with the feature `{self}`");
                Err(ModelError::Backend {
                    backend: self.to_string(),
                    reason,
                })
            }
        }
    }
}

/// Opens a GPU and computes one sum on it: burn opens devices late, and panics where it cannot.
#[cfg(feature = "wgpu")]
fn probe(backend: Backend, open: fn() -> Device) -> Result<Device, ModelError> {
    use burn::tensor::Tensor;

    let failed = |reason: String| ModelError::Backend {
        backend: backend.to_string(),
        reason,
    };
    let attempt = std::panic::catch_unwind(|| {
        let device = open();
        let sum = Tensor::<1>::from_floats([1.0, 2.0], &device).sum();
        sum.try_into_data()
            .map(|_| device)
            .map_err(|error| error.to_string())
    });
    match attempt {
        Ok(result) => result.map_err(failed),
        Err(panic) => {
            let words = panic.downcast_ref::<String>().cloned();
            let words = words.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
            let words = words.unwrap_or_else(|| "it could not be opened".to_owned());
            Err(failed(format!("no usable device here ({words})")))
        }
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Backend {
    type Err = ModelError;

    /// Reads a name, with or without the prefix `burn-`.
    fn from_str(text: &str) -> Result<Self, ModelError> {
        let name = text.strip_prefix("burn-").unwrap_or(text);
        Self::ALL
            .into_iter()
            .find(|backend| backend.name() == name)
            .ok_or_else(|| {
                let reason = "there are flex, ndarray and wgpu".to_owned();
                ModelError::Backend {
                    backend: text.to_owned(),
                    reason,
                }
            })
    }
}
