use super::JointConfig;
use crate::Parameters;

/// The values of a joint network.
pub type JointParameters = Parameters<JointConfig>;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ModelError, Precision, TensorFile, write_tensors};
    use std::collections::BTreeMap;

    #[test]
    fn a_file_that_promises_more_than_it_holds_is_refused_before_anything_is_allocated() {
        let small = JointConfig::new(4, &[1, 2]);
        let parameters = JointParameters::init(&small, 3).unwrap();
        let layout = parameters.layout();
        let tensors: Vec<_> = parameters.tensors("", &layout).collect();
        let bytes = write_tensors(&tensors, Precision::F32, &BTreeMap::new()).unwrap();
        let file = TensorFile::new(&bytes).unwrap();
        // Twelve gigabytes.
        let large = JointConfig {
            embedding: 4096,
            ..JointConfig::new(4096, &[1; 64])
        };
        let refused = JointParameters::read(large, "", &file).unwrap_err();
        assert!(
            matches!(refused, ModelError::TensorShape { .. }),
            "{refused}"
        );
    }

    #[test]
    fn a_file_gives_back_what_was_written() {
        let config = JointConfig::new(4, &[1, 2]);
        let parameters = JointParameters::init(&config, 3).unwrap();
        let layout = parameters.layout();
        let tensors: Vec<_> = parameters.tensors("joint.", &layout).collect();
        let bytes = write_tensors(&tensors, Precision::F32, &BTreeMap::new()).unwrap();
        let file = TensorFile::new(&bytes).unwrap();
        let read = JointParameters::read(config.clone(), "joint.", &file).unwrap();
        assert_eq!(read, parameters);
        assert!(JointParameters::read(config, "other.", &file).is_err());
        let wider = JointConfig::new(5, &[1, 2]);
        assert!(JointParameters::read(wider, "joint.", &file).is_err());
    }
}
