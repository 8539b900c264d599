//! Figures: elements are drawn in the right places.

use delta_cal_host::render::plot::{Axis, Colour, Figure, Shape};
use roxmltree::{Document, Node};

/// Positions are rounded to the drawing's units, once at each end.
const ROUNDING: f64 = 1.01;

/// The steps from each point of a drawing to the next, right and down.
fn steps(figure: Figure, points: &[(f64, f64)]) -> Vec<[f64; 2]> {
    let shape = Shape::Points(points.to_vec());
    let svg = figure.with("measured", Colour::Blue, shape).to_svg();
    let document = Document::parse(&svg).unwrap();
    let centre = |node: Node<'_, '_>| {
        ["cx", "cy"].map(|name| node.attribute(name).unwrap().parse::<f64>().unwrap())
    };
    let circles = document
        .descendants()
        .filter(|node| node.tag_name().name() == "circle");
    // The first circle belongs to the legend.
    let centres: Vec<_> = circles.skip(1).map(centre).collect();
    let pairs = centres.windows(2);
    pairs
        .map(|pair| [0, 1].map(|axis| pair[1][axis] - pair[0][axis]))
        .collect()
}

#[test]
fn equal_steps_are_equally_far_apart_and_what_has_no_place_is_left_out() {
    let (x, y) = (
        Axis::logarithmic("noise", 1e-3, 1e1),
        Axis::linear("gain", 0.0, 100.0),
    );
    let points = [
        (0.0, 10.0),
        (-2.0, 10.0),
        (1e-2, 20.0),
        (f64::NAN, 30.0),
        (1e-1, 40.0),
        (1e0, 60.0),
        (1e0, f64::INFINITY),
        (1e0, 101.0),
        (1e1, 80.0),
    ];
    let found = steps(Figure::new(x, y), &points);
    assert_eq!(found.len(), 3);
    for [right, down] in &found {
        assert!(
            *right > 0.0 && (right - found[0][0]).abs() <= ROUNDING,
            "{found:?}"
        );
        assert!(
            *down < 0.0 && (down - found[0][1]).abs() <= ROUNDING,
            "{found:?}"
        );
    }
    let (x, y) = (
        Axis::linear("x, mm", 0.0, 10.0),
        Axis::linear("z, mm", 0.0, 80.0),
    );
    let found = steps(
        Figure::new(x, y).with_equal_scales(),
        &[(0.0, 0.0), (10.0, 10.0)],
    );
    assert!(found[0][0] > 10.0 && (found[0][0] + found[0][1]).abs() <= 2.0 * ROUNDING);
}

#[test]
fn axes_legend_and_labels_are_written_and_escaped() {
    let label = vec![((2.0, 2.0), "a <line> & \"more\"".to_owned())];
    let (x, y) = (
        Axis::linear("poses", 0.0, 10.0),
        Axis::logarithmic("σ, mm", 0.001, 10.0),
    );
    let figure = Figure::new(x, y).with("the <paper>", Colour::Ink, Shape::Labels(label));
    let svg = figure.to_svg();
    let document = Document::parse(&svg).unwrap();
    let texts: Vec<_> = document
        .descendants()
        .filter_map(|node| node.text())
        .collect();
    for expected in [
        "poses",
        "σ, mm",
        "a <line> & \"more\"",
        "the <paper>",
        "0.01",
    ] {
        assert!(
            texts.iter().any(|text| text.trim() == expected),
            "{expected}: {texts:?}"
        );
    }
}
