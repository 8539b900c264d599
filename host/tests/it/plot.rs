//! Figures: elements are drawn in the right places.

use delta_cal_host::render::plot::{Axis, Colour, Figure, Shape};
use roxmltree::Document;

/// Positions are rounded to the drawing's units, once at each end.
const ROUNDING: f64 = 1.01;

/// The steps from each point of a drawing to the next, right and down.
fn steps(figure: Figure, points: &[(f64, f64)]) -> Vec<[f64; 2]> {
    let shape = Shape::Points(points.to_vec());
    let svg = figure.with("measured", Colour::Blue, shape).to_svg();
    let document = Document::parse(&svg).unwrap();
    let nodes = document.descendants();
    let circles = nodes.filter(|node| node.tag_name().name() == "circle");
    // The first circle belongs to the legend.
    let centres: Vec<[f64; 2]> = circles
        .skip(1)
        .map(|node| ["cx", "cy"].map(|name| node.attribute(name).unwrap().parse().unwrap()))
        .collect();
    let pairs = centres.windows(2);
    let step = |pair: &[[f64; 2]]| [0, 1].map(|axis| pair[1][axis] - pair[0][axis]);
    pairs.map(step).collect()
}

#[test]
fn equal_steps_are_equally_far_apart_and_what_has_no_place_is_left_out() {
    let noise = Axis::logarithmic("noise", 1e-3, 1e1);
    let figure = Figure::new(noise, Axis::linear("gain", 0.0, 100.0));
    let drawn = [(1e-2, 20.0), (1e-1, 40.0), (1e0, 60.0), (1e1, 80.0)];
    let beyond = [(0.0, 10.0), (-2.0, 10.0), (1e0, 101.0)];
    let not_finite = [(f64::NAN, 30.0), (1e0, f64::INFINITY)];
    let found = steps(figure, &[&drawn[..], &beyond, &not_finite].concat());
    assert_eq!(found.len(), 3);
    for [right, down] in &found {
        let [first, second] = found[0];
        let even = (right - first).abs() <= ROUNDING && (down - second).abs() <= ROUNDING;
        assert!(*right > 0.0 && *down < 0.0 && even, "{found:?}");
    }
    let axis = |high| Axis::linear("mm", 0.0, high);
    let figure = Figure::new(axis(10.0), axis(80.0)).with_equal_scales();
    let [right, down] = steps(figure, &[(0.0, 0.0), (10.0, 10.0)])[0];
    assert!(right > 10.0 && (right + down).abs() <= 2.0 * ROUNDING);
}

#[test]
fn axes_legend_and_labels_are_written_and_escaped() {
    let label = "a <line> & \"more\"";
    let y = Axis::logarithmic("σ, mm", 0.001, 10.0);
    let figure = Figure::new(Axis::linear("poses", 0.0, 10.0), y);
    let labels = Shape::Labels(vec![((2.0, 2.0), label.to_owned())]);
    let svg = figure.with("the <paper>", Colour::Ink, labels).to_svg();
    let document = Document::parse(&svg).unwrap();
    for expected in ["poses", "σ, mm", label, "the <paper>", "0.01"] {
        let mut texts = document.descendants().filter_map(|node| node.text());
        assert!(texts.any(|text| text.trim() == expected), "{expected}");
    }
}
