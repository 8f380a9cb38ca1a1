//! Vectors of f32 and the choice of instruction set at run time.
//!
//! Kernels are generic over [`Simd`] and always inlined into one entry point per
//! instruction set (see [`dispatch!`]), so a default build runs the widest vectors that the
//! machine has.

use std::sync::OnceLock;

#[cfg(target_arch = "aarch64")]
mod neon;
mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

#[cfg(target_arch = "aarch64")]
pub(crate) use neon::Neon;
pub(crate) use portable::Portable;
#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2, Avx512};

/// Variable of the environment that names the instructions to use (`portable`, `avx2`, `avx512`, `neon`): to try on one
/// machine what another computes. What the machine lacks, or nobody knows, counts as not named.
pub const VARIABLE: &str = "DOSE3_INSTRUCTIONS";

/// A set of vector instructions the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Instructions {
    /// Whatever the compiler makes of plain arithmetic; runs everywhere.
    Portable,
    /// x86-64 with AVX2 and FMA, 8 lanes.
    Avx2,
    /// x86-64 with AVX-512 F, 16 lanes.
    Avx512,
    /// 64-bit ARM, 4 lanes.
    Neon,
}

impl Instructions {
    /// All of them, available or not.
    pub const ALL: [Self; 4] = [Self::Portable, Self::Avx2, Self::Avx512, Self::Neon];

    /// Whether this machine has them.
    pub fn available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
            }
            #[cfg(target_arch = "aarch64")]
            Self::Neon => std::arch::is_aarch64_feature_detected!("neon"),
            #[allow(unreachable_patterns)] // which arms exist depends on the target
            _ => false,
        }
    }

    /// Its name in [`VARIABLE`].
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
        }
    }

    /// The set that [`VARIABLE`] names where this machine has it, else the widest that it has. The same in all of a
    /// process: the variable is read once.
    pub fn detect() -> Self {
        static DETECTED: OnceLock<Instructions> = OnceLock::new();
        *DETECTED.get_or_init(|| {
            let named = std::env::var(VARIABLE).ok();
            let named = named.and_then(|name| Self::ALL.into_iter().find(|set| set.name() == name));
            let widest = [Self::Avx512, Self::Avx2, Self::Neon].into_iter();
            named
                .into_iter()
                .chain(widest)
                .find(|set| set.available())
                .unwrap_or(Self::Portable)
        })
    }
}

/// A set that is known to be available: the token that makes calling its kernels sound.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Isa(Instructions);

impl Isa {
    /// `None` where the machine lacks the set.
    pub(crate) fn new(set: Instructions) -> Option<Self> {
        set.available().then_some(Self(set))
    }

    /// The widest set that the machine has.
    pub(crate) fn detect() -> Self {
        Self(Instructions::detect())
    }

    pub(crate) fn set(self) -> Instructions {
        self.0
    }
}

/// The operations of one instruction set.
///
/// # Safety
/// Every method requires that the machine has the set, pointers as [`std::ptr::read_unaligned`]
/// and [`std::ptr::write_unaligned`] need them for all lanes (or the `n` first).
pub(crate) trait Simd: Copy + 'static {
    /// A vector.
    type V: Copy;
    /// Numbers in a vector.
    const LANES: usize;

    unsafe fn splat(x: f32) -> Self::V;
    unsafe fn load(p: *const f32) -> Self::V;
    unsafe fn store(p: *mut f32, v: Self::V);
    /// Loads `n < LANES` numbers; the other lanes are zero.
    unsafe fn load_part(p: *const f32, n: usize) -> Self::V;
    /// Stores the `n < LANES` first numbers.
    unsafe fn store_part(p: *mut f32, n: usize, v: Self::V);
    unsafe fn add(a: Self::V, b: Self::V) -> Self::V;
    unsafe fn sub(a: Self::V, b: Self::V) -> Self::V;
    unsafe fn mul(a: Self::V, b: Self::V) -> Self::V;
    unsafe fn div(a: Self::V, b: Self::V) -> Self::V;
    unsafe fn sqrt(a: Self::V) -> Self::V;
    unsafe fn min(a: Self::V, b: Self::V) -> Self::V;
    unsafe fn max(a: Self::V, b: Self::V) -> Self::V;
    /// `a * b + c`.
    unsafe fn fma(a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// Nearest integer.
    unsafe fn round(a: Self::V) -> Self::V;
    /// `a * 2^n`, `n` integral in `[-126, 127]`.
    unsafe fn scale(a: Self::V, n: Self::V) -> Self::V;
    /// The sum of all lanes.
    unsafe fn sum(a: Self::V) -> f32;
    /// `to[j][i] = from[i][j]` for a block of `LANES` rows and columns.
    unsafe fn transpose(from: *const f32, from_row: usize, to: *mut f32, to_row: usize) {
        for i in 0..Self::LANES {
            for j in 0..Self::LANES {
                unsafe { *to.add(j * to_row + i) = *from.add(i * from_row + j) };
            }
        }
    }
    /// Asks for a cache line that will be needed soon; any address will do.
    unsafe fn prefetch(_: *const f32) {}
}

/// Loads `min(n, LANES)` numbers.
///
/// # Safety
/// As for [`Simd`].
#[inline(always)]
pub(crate) unsafe fn load_up_to<S: Simd>(p: *const f32, n: usize) -> S::V {
    unsafe {
        if n >= S::LANES {
            S::load(p)
        } else {
            S::load_part(p, n)
        }
    }
}

/// Stores `min(n, LANES)` numbers.
///
/// # Safety
/// As for [`Simd`].
#[inline(always)]
pub(crate) unsafe fn store_up_to<S: Simd>(p: *mut f32, n: usize, v: S::V) {
    unsafe {
        if n >= S::LANES {
            S::store(p, v)
        } else {
            S::store_part(p, n, v)
        }
    }
}

/// Defines a safe function that runs `$body::<S>` compiled for the set in an [`Isa`].
///
/// The body is an `unsafe fn` marked `#[inline(always)]` that is sound for any `S` the
/// machine has; the function defined is safe, so the body has to check its slices.
macro_rules! dispatch {
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $out:ty)? = $body:ident) => {
        $(#[$meta])*
        $vis fn $name(isa: $crate::simd::Isa, $($arg: $type),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx2,fma")]
            unsafe fn avx512($($arg: $type),*) $(-> $out)? {
                // SAFETY: this function's own requirement.
                unsafe { $body::<$crate::simd::Avx512>($($arg),*) }
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            unsafe fn avx2($($arg: $type),*) $(-> $out)? {
                // SAFETY: this function's own requirement.
                unsafe { $body::<$crate::simd::Avx2>($($arg),*) }
            }
            // SAFETY: an `Isa` exists only for a set that the machine has.
            unsafe {
                match isa.set() {
                    #[cfg(target_arch = "x86_64")]
                    $crate::simd::Instructions::Avx512 => avx512($($arg),*),
                    #[cfg(target_arch = "x86_64")]
                    $crate::simd::Instructions::Avx2 => avx2($($arg),*),
                    #[cfg(target_arch = "aarch64")]
                    $crate::simd::Instructions::Neon => $body::<$crate::simd::Neon>($($arg),*),
                    _ => $body::<$crate::simd::Portable>($($arg),*),
                }
            }
        }
    };
}
pub(crate) use dispatch;
