//! Weights through safetensors bytes, whole and broken.

use std::collections::BTreeMap;

use dose3_model::{CONFIG_KEY, ModelError, PairConfig, PairParameters, Precision, UNetConfig};
use proptest::prelude::*;
use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};

#[path = "../../ood/src/property_cases.rs"]
mod property_cases;

use property_cases::cases;

fn pair() -> PairParameters {
    let small = |channels| UNetConfig {
        heads: 1,
        head_dim: 4,
        groups: 4,
        ..UNetConfig::new(channels, 3, 8, &[1, 2])
    };
    let config = PairConfig {
        translation: small(3),
        rotation: small(9),
    };
    PairParameters::init(&config, 1).unwrap()
}

fn metadata() -> BTreeMap<String, String> {
    let entries = [
        ("trained_on", "KITTI 00-05"),
        ("note", "quotes \" and \u{e9}"),
        ("a", ""),
    ];
    entries
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .into()
}

fn read(bytes: &[u8]) -> Result<PairParameters, ModelError> {
    PairParameters::from_safetensors(bytes).map(|(pair, _)| pair)
}

#[test]
fn f32_round_trips_exactly() {
    let bytes = pair().to_safetensors(Precision::F32, &metadata()).unwrap();
    let (read, about) = PairParameters::from_safetensors(&bytes).unwrap();
    assert_eq!(read, pair());
    assert_eq!(about, metadata());
}

#[test]
fn f16_rounds_once_and_halves_the_file() {
    let full = pair().to_safetensors(Precision::F32, &metadata()).unwrap();
    let half = pair().to_safetensors(Precision::F16, &metadata()).unwrap();
    assert!(half.len() < full.len() * 6 / 10);
    let rounded = read(&half).unwrap();
    let networks = [
        (&rounded.translation, pair().translation),
        (&rounded.rotation, pair().rotation),
    ];
    for (found, expected) in networks {
        for (a, b) in found.values.iter().zip(&expected.values) {
            // Half a unit in the last place, or of the smallest subnormal.
            let bound = (b.abs() * 2f32.powi(-11)).max(2f32.powi(-25));
            assert!((a - b).abs() <= bound, "{b} became {a}");
        }
        assert_ne!(found.values, expected.values);
    }
    assert_eq!(
        rounded.to_safetensors(Precision::F16, &metadata()).unwrap(),
        half
    );
}

#[test]
fn the_same_weights_give_the_same_bytes() {
    let bytes = pair().to_safetensors(Precision::F32, &metadata()).unwrap();
    for _ in 0..10 {
        assert_eq!(
            pair().to_safetensors(Precision::F32, &metadata()).unwrap(),
            bytes
        );
    }
}

#[test]
fn weights_that_cannot_be_stored_are_refused() {
    let mut pair = pair();
    let reserved = BTreeMap::from([(CONFIG_KEY.to_owned(), String::new())]);
    let error = pair.to_safetensors(Precision::F32, &reserved).unwrap_err();
    assert!(matches!(error, ModelError::Metadata { .. }), "{error}");

    pair.rotation.values[3] = 1e6;
    let error = pair
        .to_safetensors(Precision::F16, &metadata())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("rotation.time_mlp.linear1.weight[3]"),
        "{error}"
    );
    pair.to_safetensors(Precision::F32, &metadata()).unwrap();

    pair.rotation.values[3] = f32::NAN;
    let error = pair
        .to_safetensors(Precision::F32, &metadata())
        .unwrap_err();
    assert!(
        matches!(error, ModelError::NotFinite { index: 3, .. }),
        "{error}"
    );
}

struct Tensor {
    name: String,
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

/// Writes the file again after `edit` changed its tensors and its configuration text.
fn edited(edit: impl FnOnce(&mut Vec<Tensor>, &mut String)) -> Vec<u8> {
    let bytes = pair()
        .to_safetensors(Precision::F32, &BTreeMap::new())
        .unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let mut tensors: Vec<_> = file
        .tensors()
        .into_iter()
        .map(|(name, view)| Tensor {
            name,
            dtype: view.dtype(),
            shape: view.shape().to_vec(),
            bytes: view.data().to_vec(),
        })
        .collect();
    tensors.sort_by(|a, b| a.name.cmp(&b.name));
    let mut config = serde_json::to_string(&pair().config()).unwrap();
    edit(&mut tensors, &mut config);
    let views = tensors.iter().map(|t| {
        (
            &t.name,
            TensorView::new(t.dtype, t.shape.clone(), &t.bytes).unwrap(),
        )
    });
    let info = [(CONFIG_KEY.to_owned(), config)].into();
    serialize(views, Some(info)).unwrap()
}

#[test]
fn a_file_written_by_another_writer_is_read() {
    assert_eq!(read(&edited(|_, _| {})).unwrap(), pair());
}

#[test]
fn every_broken_tensor_is_named() {
    const NAME: &str = "rotation.init_conv.weight";
    fn at(tensors: &mut [Tensor]) -> &mut Tensor {
        tensors.iter_mut().find(|t| t.name == NAME).unwrap()
    }
    let cases: [(&str, Vec<u8>); 7] = [
        (
            "missing",
            edited(|tensors, _| tensors.retain(|t| t.name != NAME)),
        ),
        (
            "does not belong",
            edited(|tensors, _| at(tensors).name.push('2')),
        ),
        (
            "does not belong",
            edited(|tensors, _| at(tensors).name.insert(0, 'x')),
        ),
        ("shape", edited(|tensors, _| at(tensors).shape.swap(0, 1))),
        (
            "type I32",
            edited(|tensors, _| at(tensors).dtype = Dtype::I32),
        ),
        (
            "not finite at index 5: NaN",
            edited(|tensors, _| at(tensors).bytes[20..24].copy_from_slice(&f32::NAN.to_le_bytes())),
        ),
        (
            "not finite at index 0: inf",
            edited(|tensors, _| {
                at(tensors).bytes[..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
            }),
        ),
    ];
    for (words, bytes) in cases {
        let error = read(&bytes).unwrap_err().to_string();
        assert!(
            error.contains(words) && error.contains(NAME),
            "{words}: {error}"
        );
    }
}

#[test]
fn a_wrong_configuration_is_refused() {
    let cases = [
        ("dose3.config", edited(|_, config| config.clear())),
        (
            "dose3.config",
            edited(|_, config| *config = config.replace("heads", "hats")),
        ),
        (
            "translation: width",
            edited(|_, config| *config = config.replacen(":8", ":7", 1)),
        ),
        (
            "shape",
            edited(|_, config| *config = config.replace("[1,2]", "[1,3]")),
        ),
    ];
    for (words, bytes) in cases {
        let error = read(&bytes).unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
    }
    let tensors: [(&str, TensorView<'_>); 0] = [];
    let error = read(&serialize(tensors, None).unwrap())
        .unwrap_err()
        .to_string();
    assert!(error.contains("not DOSE3 weights"), "{error}");
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn a_file_cut_short_is_an_error(share in 0.0..1.0) {
        let bytes = pair().to_safetensors(Precision::F16, &metadata()).unwrap();
        let kept = (share * bytes.len() as f64) as usize;
        prop_assert!(read(&bytes[..kept]).is_err());
    }

    #[test]
    fn a_damaged_header_never_panics(at in 0usize..4000, byte: u8) {
        let mut bytes = pair().to_safetensors(Precision::F16, &metadata()).unwrap();
        bytes[at] = byte;
        // Damage to free text of the metadata may go unseen; anything read must be whole.
        if let Ok(found) = read(&bytes) {
            prop_assert_eq!(found.config().parameter_count(), pair().config().parameter_count());
        }
    }

    #[test]
    fn random_bytes_are_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(read(&bytes).is_err());
    }
}
