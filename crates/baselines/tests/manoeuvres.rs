//! The labels: quantile bins of turning rate and speed.

use dose3_baselines::{Error, Manoeuvres, Motion};

fn motion(yaw_rate: f64, speed: f64) -> Motion {
    Motion { yaw_rate, speed }
}

#[test]
fn nine_bins_of_equal_share() {
    let grid: Vec<Motion> = (0..90)
        .flat_map(|i| (0..90).map(move |j| motion(f64::from(i) - 45.0, f64::from(j))))
        .collect();
    let manoeuvres = Manoeuvres::fit(&grid, 3).unwrap();
    assert_eq!(manoeuvres.classes(), 9);
    let mut counts = [0; 9];
    for label in manoeuvres.labels(&grid) {
        counts[label] += 1;
    }
    assert_eq!(counts, [900; 9]);
    assert_eq!(manoeuvres.label(motion(-100.0, -1.0)), 0);
    assert_eq!(manoeuvres.label(motion(100.0, 1e9)), 8);
}

#[test]
fn turning_rate_is_the_slow_index_and_edges_belong_above() {
    let manoeuvres = Manoeuvres {
        yaw_rate_edges: vec![-0.1, 0.1],
        speed_edges: vec![1.0],
    };
    assert_eq!(manoeuvres.classes(), 6);
    let label = |yaw_rate, speed| manoeuvres.label(motion(yaw_rate, speed));
    assert_eq!([label(-0.2, 0.5), label(-0.2, 1.0)], [0, 1]);
    assert_eq!([label(0.0, 0.5), label(0.1, 2.0)], [2, 5]);
}

#[test]
fn equal_windows_share_a_bin() {
    // Half the windows stand still: two of the three edges would be 0.
    let mut motions = vec![motion(0.0, 0.0); 50];
    motions.extend((1..=50).map(|i| motion(0.0, f64::from(i))));
    let manoeuvres = Manoeuvres::fit(&motions, 3).unwrap();
    assert!(manoeuvres.yaw_rate_edges.is_empty());
    assert_eq!(manoeuvres.speed_edges.len(), 1);
    assert_eq!(manoeuvres.classes(), 2);
}

#[test]
fn motions_without_classes_are_refused() {
    let same = vec![motion(0.1, 1.0); 10];
    assert!(matches!(Manoeuvres::fit(&same, 3), Err(Error::Labels(_))));
    assert!(matches!(Manoeuvres::fit(&[], 3), Err(Error::Labels(_))));
    let broken = [motion(f64::NAN, 1.0), motion(0.0, 2.0)];
    assert!(matches!(Manoeuvres::fit(&broken, 3), Err(Error::Labels(_))));
}
