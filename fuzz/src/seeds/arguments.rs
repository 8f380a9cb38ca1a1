//! Command lines, lists and lines of poses.

use super::logs;
use std::fmt::Write as _;

/// A command line for each subcommand, a word a line.
pub fn lines() -> Vec<Vec<u8>> {
    [
        "demo --out a --force",
        "train --data a b --out m --representation motion --resample 10 --frame body-flu --width 8 --multipliers 1,2 \
         --rotation-noise ig-so3 --half --hold-out none --learning-rate 1e-3",
        "fit --trusted a --list l.csv --out d --group {}_run* --statistics kinematic,lin/cc --shares 0.5,0.5 \
         --density mixture:2 --alpha 0.05 --noise own --tf map:base_link --unit 0.001 --lost nan,zero",
        "score --detector d --fdr 0.05 --out a.csv --html a.html --mcap a.mcap --json --columns t=stamp,x=3 -",
        "score --detector=d --output jsonl -v --list - --frame drive=body-frd --stamp record --log-column run",
        "eval --detector d --id a --ood b c --resamples 100 --json",
        "inspect a.mcap --topic /odom --topic /pose --json --stamp-unit ns --max-gap 1.5",
        "sample --model paper --out a --count 3 --seed 7 --threads 2 --backend engine",
        "watch --detector d --follow a --alarms-per-hour 0.5 --every 8 --heartbeat 0 --state s --reset 3 --rate 20",
        "completions zsh",
        "man a",
        "--help",
    ]
    .map(|line| line.split_whitespace().collect::<Vec<_>>().join("\n").into_bytes())
    .to_vec()
}

/// Lists of logs.
pub fn lists() -> Vec<Vec<u8>> {
    [
        "path,group\na.txt,hall\n\"b, c.txt\",\n",
        "group; path\r\n",
        "\n a.txt\nb.txt\n\n",
    ]
    .map(|text| text.as_bytes().to_vec())
    .to_vec()
}

/// Poses as lines of text and of JSON.
pub fn poses() -> Vec<Vec<u8>> {
    let (mut text, mut json) = (String::from("# stamp\n"), String::new());
    for (stamp, pose) in logs()[0].stamps.iter().zip(&logs()[0].poses).take(6) {
        let q = dose3_lie::nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
        let p = pose.translation;
        let seconds = *stamp as f64 * 1e-9;
        let _ = writeln!(
            text,
            "{seconds} {} {} {} {} {} {} {}",
            p.x, p.y, p.z, q.i, q.j, q.k, q.w
        );
        let line = serde_json::json!({
            "stamp_ns": stamp, "position": [p.x, p.y, p.z], "orientation": [q.i, q.j, q.k, q.w],
        });
        let _ = writeln!(json, "{line}");
    }
    json.push_str("{\"t\": \"1.5\", \"p\": {\"x\": 1, \"y\": null, \"z\": 3}, \"q\": {\"x\":0,\"y\":0,\"z\":0,\"w\":1}}\n");
    vec![text.into_bytes(), json.into_bytes()]
}
