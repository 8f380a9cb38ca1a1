//! Poses in files: written and read without loss, and checked when read.

use dose3_lie::{Pose, Twist, se3};

fn example() -> Pose {
    se3::exp(&Twist::new(1.5, -20.25, 1e-9, 0.3, -1.0, 2.0))
}

#[test]
fn reading_gives_back_the_same_bits() {
    let written = serde_json::to_string(&example()).unwrap();
    let read: Pose = serde_json::from_str(&written).unwrap();
    assert_eq!(read, example());
}

#[test]
fn rows_come_first() {
    let mut expected = Pose::identity();
    expected.rotation = dose3_lie::Rotation::from_matrix_unchecked(dose3_lie::Matrix::new(
        0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
    ));
    expected.translation.x = 4.0;
    let text =
        r#"{"rotation":[[0.0,-1.0,0.0],[1.0,0.0,0.0],[0.0,0.0,1.0]],"translation":[4.0,0.0,0.0]}"#;
    assert_eq!(serde_json::to_string(&expected).unwrap(), text);
    assert_eq!(serde_json::from_str::<Pose>(text).unwrap(), expected);
}

/// Message of the error that reading this text gives.
fn refusal(rotation: &str, translation: &str) -> String {
    let text = format!(r#"{{"rotation":{rotation},"translation":{translation}}}"#);
    serde_json::from_str::<Pose>(&text).unwrap_err().to_string()
}

#[test]
fn what_is_no_pose_is_refused() {
    let identity = "[[1,0,0],[0,1,0],[0,0,1]]";
    let origin = "[0,0,0]";
    assert!(refusal("[[1,0,0],[0,1,0],[0,0,-1]]", origin).contains("reflection"));
    assert!(refusal("[[0,0,0],[0,0,0],[0,0,0]]", origin).contains("singular"));
    assert!(refusal("[[1,0,0],[0,1,0],[0,0,1.001]]", origin).contains("not orthogonal"));
    assert!(refusal("[[1,0,0],[0,1,0]]", origin).contains("length"));
    assert!(refusal(identity, "[0,0]").contains("length"));
    assert!(refusal(identity, "[0,0,null]").contains("null"));
    let extra = format!(r#"{{"rotation":{identity},"translation":{origin},"scale":1}}"#);
    let refused = serde_json::from_str::<Pose>(&extra).unwrap_err();
    assert!(refused.to_string().contains("scale"));
}

#[test]
fn finiteness() {
    assert!(example().is_finite());
    let mut broken = example();
    broken.translation.y = f64::NAN;
    assert!(!broken.is_finite());
}
