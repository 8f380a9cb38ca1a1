use burn::module::{Module, Param};
use burn::tensor::{Tensor, TensorData};
use nalgebra::DMatrix;

use crate::Error;
use crate::layers::download;
use crate::source::{Init, Source, device};

/// The invertible 1x1 convolution: every pose's channels times one square matrix (Glow,
/// section 3.2), which starts as a random orthogonal one.
///
/// The matrix is plain, not in LU form: it is at most a few dozen wide, so its factors are
/// computed on the host, in f64, each time.
#[derive(Module, Debug)]
pub(super) struct Mixing {
    weight: Param<Tensor<2>>, // [channels, channels]
}

impl Mixing {
    pub(super) fn new(source: &mut Source, name: &str, channels: usize) -> Result<Self, Error> {
        let shape = [channels, channels];
        Ok(Self {
            weight: source.param(&format!("{name}.weight"), shape, Init::Orthogonal)?,
        })
    }

    /// The mixed `x` and the log-determinant for one sample, `[1]`.
    pub(super) fn forward(&self, x: Tensor<3>) -> Result<(Tensor<3>, Tensor<1>), Error> {
        let length = x.dims()[1];
        let log_det = self.log_det()? * length as f64;
        Ok((multiply(x, self.weight.val()), log_det))
    }

    pub(super) fn inverse(&self, y: Tensor<3>) -> Result<Tensor<3>, Error> {
        let (_, inverse) = factorise(&self.weight.val())?;
        Ok(multiply(y, matrix(&inverse)))
    }

    /// `ln |det W|`, `[1]`, with its gradient `W^-T`.
    fn log_det(&self) -> Result<Tensor<1>, Error> {
        let weight = self.weight.val();
        let (log_det, inverse) = factorise(&weight)?;
        // The sum's gradient by W is the one wanted; its value is replaced by the true one.
        let carrier = (weight * matrix(&inverse.transpose())).sum();
        Ok(carrier.clone() - carrier.detach() + log_det)
    }
}

fn multiply(x: Tensor<3>, weight: Tensor<2>) -> Tensor<3> {
    let [batch, length, channels] = x.dims();
    let flat = x.reshape([batch * length, channels]);
    flat.matmul(weight).reshape([batch, length, channels])
}

/// `ln |det W|` and the inverse of W.
fn factorise(weight: &Tensor<2>) -> Result<(f64, DMatrix<f64>), Error> {
    let side = weight.dims()[0];
    let values = download(weight.clone())?;
    let w = DMatrix::from_row_iterator(side, side, values.into_iter().map(f64::from));
    let lu = w.lu();
    let log_det = lu.u().diagonal().iter().map(|u| u.abs().ln()).sum::<f64>();
    match lu.try_inverse() {
        Some(inverse) if log_det.is_finite() => Ok((log_det, inverse)),
        _ => Err(Error::Singular),
    }
}

fn matrix(values: &DMatrix<f64>) -> Tensor<2> {
    let row_major: Vec<f32> = values.transpose().iter().map(|&v| v as f32).collect();
    let data = TensorData::new(row_major, [values.nrows(), values.ncols()]);
    Tensor::from_data(data, &device())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Stream, generator};

    /// The forward value is checked by the flow's numeric Jacobian; this checks the gradient.
    #[test]
    fn log_det_has_the_numeric_gradient() {
        let mut source = Source::drawn(generator(1, Stream::Weights));
        let weight = source.param("w", [4, 4], Init::FanIn(1)).unwrap();
        let values = download(weight.val()).unwrap();
        let mixing = Mixing { weight }.train();
        let gradients = mixing.log_det().unwrap().backward();
        let gradient = mixing.weight.val().grad(&gradients).unwrap();
        let gradient = download(gradient).unwrap();

        let log_det = |values: &[f64]| {
            let w = DMatrix::from_row_slice(4, 4, values);
            w.determinant().abs().ln()
        };
        let values: Vec<f64> = values.into_iter().map(f64::from).collect();
        for i in 0..16 {
            let [above, below] = [1e-6, -1e-6].map(|step| {
                let mut moved = values.clone();
                moved[i] += step;
                log_det(&moved)
            });
            let numeric = (above - below) / 2e-6;
            let claimed = f64::from(gradient[i]);
            assert!(
                (numeric - claimed).abs() < 1e-3 * (1.0 + numeric.abs()),
                "{i}: {numeric}, {claimed}"
            );
        }
    }
}
