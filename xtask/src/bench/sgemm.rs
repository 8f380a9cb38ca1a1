//! The machine's own sgemm speed, by the gemm crate: what the engine's GFLOP/s are held against.

/// GFLOP/s of one thread on a square product; `None` where this build has no gemm crate.
#[cfg(feature = "sgemm")]
pub fn peak(seconds: f64) -> Option<f64> {
    const N: usize = 768;
    let (a, b, mut c) = (vec![1f32; N * N], vec![1f32; N * N], vec![0f32; N * N]);
    let n = N as isize;
    let time = super::best(seconds, || {
        // SAFETY: three N x N matrices, row-major.
        unsafe {
            gemm::gemm(
                N,
                N,
                N,
                c.as_mut_ptr(),
                1,
                n,
                false,
                a.as_ptr(),
                1,
                n,
                b.as_ptr(),
                1,
                n,
                0f32,
                1f32,
                false,
                false,
                false,
                gemm::Parallelism::None,
            );
        }
        Ok(())
    });
    Some(2.0 * (N * N * N) as f64 / time.ok()? / 1e9)
}

/// GFLOP/s of one thread on a square product; `None` where this build has no gemm crate.
#[cfg(not(feature = "sgemm"))]
pub fn peak(_: f64) -> Option<f64> {
    None
}
