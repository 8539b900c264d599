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
    let circles = nodes.filter(|node| node.has_tag_name((SVG, "circle")));
    // The first circle belongs to the legend.
    let centres: Vec<[f64; 2]> = circles
        .skip(1)
        .map(|node| ["cx", "cy"].map(|name| node.attribute(name).unwrap().parse().unwrap()))
        .collect();
    let pairs = centres.windows(2);
    pairs
        .map(|pair| [0, 1].map(|axis| pair[1][axis] - pair[0][axis]))
        .collect()
}

const SVG: &str = "http://www.w3.org/2000/svg";

#[test]
fn equal_steps_are_equally_far_apart_and_what_has_no_place_is_left_out() {
    let noise = Axis::logarithmic("noise", 1e-3, 1e1);
    let figure = Figure::new(noise, Axis::linear("gain", 0.0, 100.0));
    let drawn = [(1e-2, 20.0), (1e-1, 40.0), (1e0, 60.0), (1e1, 80.0)];
    let not_drawn = [
        (0.0, 10.0),
        (-2.0, 10.0),
        (f64::NAN, 30.0),
        (1e0, f64::INFINITY),
        (1e0, 101.0),
    ];
    let found = steps(figure, &[&drawn[..], &not_drawn[..]].concat());
    assert_eq!(found.len(), 3);
    for [right, down] in &found {
        let [first, second] = found[0];
        assert!(
            *right > 0.0 && (right - first).abs() <= ROUNDING,
            "{found:?}"
        );
        assert!(
            *down < 0.0 && (down - second).abs() <= ROUNDING,
            "{found:?}"
        );
    }
    let (x, y) = (
        Axis::linear("x, mm", 0.0, 10.0),
        Axis::linear("z, mm", 0.0, 80.0),
    );
    let figure = Figure::new(x, y).with_equal_scales();
    let [right, down] = steps(figure, &[(0.0, 0.0), (10.0, 10.0)])[0];
    assert!(right > 10.0 && (right + down).abs() <= 2.0 * ROUNDING);
}

#[test]
fn axes_legend_and_labels_are_written_and_escaped() {
    let label = "a <line> & \"more\"";
    let (x, y) = (
        Axis::linear("poses", 0.0, 10.0),
        Axis::logarithmic("σ, mm", 0.001, 10.0),
    );
    let labels = Shape::Labels(vec![((2.0, 2.0), label.to_owned())]);
    let svg = Figure::new(x, y)
        .with("the <paper>", Colour::Ink, labels)
        .to_svg();
    let document = Document::parse(&svg).unwrap();
    for expected in ["poses", "σ, mm", label, "the <paper>", "0.01"] {
        let mut texts = document.descendants().filter_map(|node| node.text());
        assert!(texts.any(|text| text.trim() == expected), "{expected}");
    }
}
