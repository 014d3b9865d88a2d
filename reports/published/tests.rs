//! The exhibits are well formed, and what they leave out has its meaning.

use super::*;

#[test]
fn every_file_is_well_formed_and_names_what_exists() {
    let exhibits = published();
    for exhibit in &exhibits {
        assert_eq!(exhibit.check(), Ok(()));
    }
    let mut ids: Vec<&str> = exhibits.iter().map(|e| e.id.as_str()).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), exhibits.len());
}

#[test]
fn inputs_are_in_their_own_unit_and_measured_as_they_are_unless_they_say_otherwise() {
    let input = |text: &str| serde_json::from_str::<RowInput>(text);
    let plain = input(r#"{"mesh": "bear.off", "noise": {"eta": 0.01, "seed": 1}}"#).unwrap();
    assert_eq!(plain.scale, 1.0);
    assert_eq!(plain.noise.unwrap().against, Against::Noisy);
    let noise = r#"{"eta": 0.01, "seed": 1, "against": "clean"}"#;
    let other = input(&format!(r#"{{"mesh": "bear.off", "scale": 1000, "noise": {noise}}}"#));
    let other = other.unwrap();
    assert_eq!((other.scale, other.noise.unwrap().against), (1000.0, Against::Clean));
    let mut exhibit = published().swap_remove(0);
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        exhibit.rows[0].input.scale = scale;
        assert!(exhibit.check().is_err_and(|why| why.contains("scaled")), "{scale}");
    }
}

#[test]
fn only_what_a_column_reads_is_measured() {
    let mut exhibit = published().swap_remove(0);
    let mut needs = |place: &str| {
        exhibit.columns.truncate(1);
        exhibit.columns[0].of = vec![place.to_owned()];
        [
            exhibit.needs_evaluation(),
            exhibit.needs_samples(),
            exhibit.needs_volume(),
            exhibit.needs_union(),
        ]
    };
    assert_eq!(needs("/simplify/spheres"), [false, false, false, false]);
    assert_eq!(needs("/evaluate/betti/0"), [true, false, false, false]);
    assert_eq!(needs("/evaluate/volume_error"), [true, true, true, false]);
    assert_eq!(needs("/noise/shift/in_space/computed_to_true_max"), [true, true, false, false]);
    assert_eq!(needs("/union/betti/1"), [false, false, false, true]);
}

#[test]
fn names_that_lead_nowhere_are_found() {
    let mut exhibit = published().swap_remove(1);
    exhibit.claims = vec![Claim {
        says: String::new(),
        if_not: None,
        means: vec![Comparison {
            left: "bear/none".into(),
            is: Relation::Less,
            right: Operand::Number(1.0),
        }],
    }];
    assert!(exhibit.check().is_err_and(|why| why.contains("bear/none")));
    exhibit.claims.clear();
    exhibit.rows[0].published.insert("nothing".into(), 1.0);
    assert!(exhibit.check().is_err_and(|why| why.contains("nothing")));
}
