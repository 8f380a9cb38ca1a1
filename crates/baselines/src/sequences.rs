use crate::Error;

/// Windows of poses as plain numbers: `data` is `[windows, length, channels]`, row-major.
///
/// With 6 channels: translation x, y, z, then the rotation's tangent vector x, y, z. Units and
/// frame are the caller's; every channel is standardised with constants of the training windows.
#[derive(Clone, Copy, Debug)]
pub struct Sequences<'a> {
    /// Poses per window.
    pub length: usize,
    /// Numbers per pose.
    pub channels: usize,
    /// All windows, one after another.
    pub data: &'a [f32],
}

impl<'a> Sequences<'a> {
    /// Numbers per window.
    pub fn dimension(&self) -> usize {
        self.length * self.channels
    }

    /// How many windows there are.
    pub fn windows(&self) -> usize {
        self.data.len() / self.dimension().max(1)
    }

    /// One window, `[length, channels]`.
    ///
    /// # Panics
    /// If there are not so many windows.
    pub fn window(&self, index: usize) -> &'a [f32] {
        &self.data[index * self.dimension()..][..self.dimension()]
    }

    /// Checks the shape and that every number is finite.
    ///
    /// # Errors
    /// [`Error::Shape`] or [`Error::NotFinite`].
    pub fn check(&self) -> Result<(), Error> {
        let dimension = self.dimension();
        if dimension == 0 || !self.data.len().is_multiple_of(dimension) {
            return Err(Error::Shape {
                found: self.data.len(),
                length: self.length,
                channels: self.channels,
            });
        }
        match self.data.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(Error::NotFinite {
                what: "windows".to_owned(),
                index,
                value: f64::from(self.data[index]),
            }),
            None => Ok(()),
        }
    }

    /// As [`check`](Self::check), and there must be windows to train on.
    pub(crate) fn check_training(&self) -> Result<(), Error> {
        self.check()?;
        if self.data.is_empty() {
            return Err(Error::Empty);
        }
        Ok(())
    }

    /// As [`check`](Self::check), and the shape must be the one trained on.
    pub(crate) fn check_against(&self, length: usize, channels: usize) -> Result<(), Error> {
        self.check()?;
        if (self.length, self.channels) != (length, channels) {
            return Err(Error::OtherShape {
                expected_length: length,
                expected_channels: channels,
                length: self.length,
                channels: self.channels,
            });
        }
        Ok(())
    }
}
