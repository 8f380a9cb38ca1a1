//! Configurations, layouts and starting values.

use dose3_model::{
    Init, ModelError, PairConfig, PairParameters, Parameters, UNetConfig, sinusoidal,
};

#[test]
fn the_layout_covers_the_flat_vector_without_gaps() {
    let config = UNetConfig::new(9, 3, 16, &[1, 2, 4]);
    let layout = config.layout();
    let mut next = 0;
    for spec in layout.entries() {
        assert_eq!(spec.offset, next, "{}", spec.name);
        assert_eq!(layout.find(&spec.name), Some(spec));
        next += spec.size();
    }
    assert_eq!(layout.len(), next);
    assert_eq!(layout.find("downs.0.block1"), None);
}

#[test]
fn blocks_project_their_residual_only_where_channels_change() {
    let layout = UNetConfig::new(3, 3, 16, &[1, 2]).layout();
    assert!(layout.find("downs.1.block2.residual.weight").is_none());
    assert!(layout.find("mid.block1.residual.weight").is_none());
    // The deepest level on the way up takes 32 channels and a skip of 16 to 32.
    assert_eq!(
        layout.find("ups.0.block1.residual.weight").unwrap().shape,
        [32, 48, 1]
    );
    assert_eq!(
        layout.find("final_block.residual.weight").unwrap().shape,
        [16, 32, 1]
    );
    assert_eq!(
        layout.find("downs.0.resample.weight").unwrap().shape,
        [16, 16, 4]
    );
    assert_eq!(
        layout.find("downs.1.resample.weight").unwrap().shape,
        [32, 16, 3]
    );
    assert_eq!(
        layout.find("ups.1.resample.weight").unwrap().shape,
        [16, 16, 3]
    );
}

#[test]
fn parameters_are_as_many_as_in_pytorch() {
    // Counted on the modules of golden/generate.py.
    let counts = |width, multipliers: &[usize]| {
        let pair = PairConfig::new(width, multipliers);
        (
            pair.translation.parameter_count(),
            pair.rotation.parameter_count(),
        )
    };
    assert_eq!(counts(16, &[1, 2, 4]), (382_739, 383_411));
    assert_eq!(counts(128, &[1, 2, 4, 8]), (57_329_283, 57_334_659));
}

#[test]
fn starting_values_have_pytorchs_statistics() {
    let config = UNetConfig::new(9, 3, 32, &[1, 2]);
    let parameters = Parameters::init(&config, 3).unwrap();
    for spec in config.layout().entries() {
        let values = &parameters.values[spec.range()];
        match spec.init {
            Init::Ones => assert!(values.iter().all(|&v| v == 1.0), "{}", spec.name),
            Init::Zeros => assert!(values.iter().all(|&v| v == 0.0), "{}", spec.name),
            Init::Uniform { bound } => {
                assert!(values.iter().all(|v| v.abs() <= bound), "{}", spec.name);
                if values.len() < 1000 {
                    continue;
                }
                // Mean 0 and variance bound^2 / 3, within 5 standard errors.
                let n = values.len() as f64;
                let bound = f64::from(bound);
                let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
                let second = values.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>() / n;
                let deviation = bound / 3f64.sqrt();
                assert!(
                    mean.abs() < 5.0 * deviation / n.sqrt(),
                    "{}: mean {mean}",
                    spec.name
                );
                let spread = (second / (bound * bound / 3.0) - 1.0).abs();
                assert!(
                    spread < 5.0 * 0.8f64.sqrt() / n.sqrt(),
                    "{}: {spread}",
                    spec.name
                );
            }
        }
    }
    let bound = |name| match config.layout().find(name).unwrap().init {
        Init::Uniform { bound } => bound,
        other => panic!("{other:?}"),
    };
    // The bias of a layer takes the fan-in of its weight: 9 channels times kernel 7.
    assert_eq!(bound("init_conv.weight"), (1.0 / 63f64.sqrt()) as f32);
    assert_eq!(bound("init_conv.bias"), bound("init_conv.weight"));
}

#[test]
fn the_seed_decides() {
    let config = PairConfig::new(8, &[1, 2]);
    let pair = PairParameters::init(&config, 4).unwrap();
    assert_eq!(pair, PairParameters::init(&config, 4).unwrap());
    assert_ne!(pair, PairParameters::init(&config, 5).unwrap());
    // The two networks do not start from the same numbers.
    assert_ne!(pair.translation.values[..64], pair.rotation.values[..64]);
}

#[test]
fn configurations_that_cannot_be_built_are_refused() {
    let good = UNetConfig::new(3, 3, 16, &[1, 2]);
    good.validate().unwrap();
    let cases = [
        (
            "in_channels",
            UNetConfig {
                in_channels: 0,
                ..good.clone()
            },
        ),
        (
            "out_channels",
            UNetConfig {
                out_channels: 0,
                ..good.clone()
            },
        ),
        (
            "width",
            UNetConfig {
                width: 0,
                ..good.clone()
            },
        ),
        (
            "even",
            UNetConfig {
                width: 9,
                groups: 3,
                ..good.clone()
            },
        ),
        (
            "at least 4",
            UNetConfig {
                width: 2,
                groups: 1,
                ..good.clone()
            },
        ),
        (
            "groups",
            UNetConfig {
                width: 12,
                ..good.clone()
            },
        ),
        (
            "heads",
            UNetConfig {
                heads: 0,
                ..good.clone()
            },
        ),
        (
            "head_dim",
            UNetConfig {
                head_dim: usize::MAX,
                ..good.clone()
            },
        ),
        (
            "multiplier",
            UNetConfig {
                multipliers: vec![],
                ..good.clone()
            },
        ),
        (
            "multiplier",
            UNetConfig {
                multipliers: vec![1, 0],
                ..good.clone()
            },
        ),
        (
            "multipliers",
            UNetConfig {
                multipliers: vec![1; 40],
                ..good.clone()
            },
        ),
        (
            "parameters",
            UNetConfig {
                width: 1 << 16,
                multipliers: vec![1 << 16],
                ..good.clone()
            },
        ),
    ];
    for (word, config) in cases {
        let error = config.validate().unwrap_err();
        assert!(matches!(error, ModelError::Config(_)), "{error}");
        assert!(
            error.to_string().contains(word),
            "expected `{word}` in: {error}"
        );
        assert!(Parameters::init(&config, 0).is_err());
    }

    let mut pair = PairConfig::new(16, &[1]);
    pair.rotation.in_channels = 3;
    let error = pair.validate().unwrap_err().to_string();
    assert!(error.contains("rotation") && error.contains('9'), "{error}");
}

#[test]
fn values_are_checked_against_the_layout() {
    let config = UNetConfig::new(3, 3, 8, &[1]);
    let mut values = Parameters::init(&config, 0).unwrap().values;
    let error = Parameters::new(config.clone(), values[1..].to_vec()).unwrap_err();
    assert!(
        matches!(error, ModelError::ParameterCount { .. }),
        "{error}"
    );

    let at = config.layout().find("init_conv.bias").unwrap().offset + 2;
    values[at] = f32::INFINITY;
    let error = Parameters::new(config, values).unwrap_err().to_string();
    assert!(
        error.contains("init_conv.bias is not finite at index 2"),
        "{error}"
    );
}

#[test]
fn time_features_are_sines_and_cosines_of_falling_frequency() {
    let features = sinusoidal(3.0, 6);
    for (j, frequency) in [1.0, 1e-2, 1e-4f64].into_iter().enumerate() {
        assert!((f64::from(features[j]) - (3.0 * frequency).sin()).abs() < 1e-7);
        assert!((f64::from(features[3 + j]) - (3.0 * frequency).cos()).abs() < 1e-7);
    }
}
