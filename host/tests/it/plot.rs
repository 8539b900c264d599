//! Figures: what is drawn is where it should be, and the same bytes every time.

use delta_cal_host::render::plot::{Axis, Colour, Figure, Shape};
use roxmltree::Document;

/// Positions are rounded to the drawing's units, once for each of two ends.
const ROUNDING: f64 = 1.01;

fn points(points: &[(f64, f64)]) -> Shape {
    Shape::Points(points.to_vec())
}

/// Centres of the discs of a drawing, without those of the legend.
fn discs(svg: &str) -> Vec<(f64, f64)> {
    let document = Document::parse(svg).unwrap();
    let number =
        |node: roxmltree::Node<'_, '_>, name| node.attribute(name).unwrap().parse().unwrap();
    document
        .descendants()
        .filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "circle")))
        .map(|node| (number(node, "cx"), number(node, "cy")))
        .skip(1)
        .collect()
}

fn texts(svg: &str) -> Vec<String> {
    let document = Document::parse(svg).unwrap();
    let texts = document.descendants().filter(roxmltree::Node::is_text);
    texts
        .map(|node| node.text().unwrap().trim().to_owned())
        .filter(|text| !text.is_empty())
        .collect()
}

#[test]
fn decades_are_equally_far_apart_on_a_logarithmic_axis_and_equal_steps_on_a_linear_one() {
    let figure = Figure::new(
        Axis::logarithmic("noise, mm", 1e-3, 1e1),
        Axis::linear("gain, %", 0.0, 100.0),
    )
    .with(
        "measured",
        Colour::Blue,
        points(&[(1e-2, 20.0), (1e-1, 40.0), (1e0, 60.0), (1e1, 80.0)]),
    );
    let found = discs(&figure.to_svg());
    assert_eq!(found.len(), 4);
    for triple in found.windows(3) {
        let steps = |of: fn(&(f64, f64)) -> f64| {
            (
                of(&triple[1]) - of(&triple[0]),
                of(&triple[2]) - of(&triple[1]),
            )
        };
        let ((right, then), (up, up_then)) = (steps(|p| p.0), steps(|p| p.1));
        assert!(right > 0.0 && (right - then).abs() <= ROUNDING, "{found:?}");
        assert!(up < 0.0 && (up - up_then).abs() <= ROUNDING, "{found:?}");
    }
}

#[test]
fn equal_scales_have_as_many_pixels_a_unit_on_both_axes() {
    let figure = Figure::new(
        Axis::linear("x, mm", 0.0, 10.0),
        Axis::linear("z, mm", 0.0, 80.0),
    )
    .with_equal_scales()
    .with(
        "measured",
        Colour::Blue,
        points(&[(0.0, 0.0), (10.0, 0.0), (0.0, 10.0)]),
    );
    let found = discs(&figure.to_svg());
    let (along, up) = (found[1].0 - found[0].0, found[0].1 - found[2].1);
    assert!(
        along > 10.0 && (along - up).abs() <= 2.0 * ROUNDING,
        "{along} {up}"
    );
}

#[test]
fn axes_legend_and_labels_are_written_and_escaped() {
    let label = vec![((2.0, 2.0), "a <line> & \"more\"".to_owned())];
    let figure = Figure::new(
        Axis::linear("poses", 0.0, 10.0),
        Axis::logarithmic("σ, mm", 0.001, 10.0),
    )
    .with("measured", Colour::Blue, points(&[(1.0, 1.0)]))
    .with("", Colour::Ink, Shape::Labels(label))
    .with(
        "the <paper>",
        Colour::Vermilion,
        Shape::Rings(vec![(5.0, 1.0)]),
    );
    let texts = texts(&figure.to_svg());
    for expected in [
        "poses",
        "σ, mm",
        "measured",
        "a <line> & \"more\"",
        "the <paper>",
        "0.01",
        "10",
    ] {
        assert!(
            texts.iter().any(|text| text == expected),
            "{expected}: {texts:?}"
        );
    }
}

#[test]
fn what_has_no_place_is_left_out() {
    let figure = Figure::new(
        Axis::linear("x", 0.0, 10.0),
        Axis::logarithmic("y", 0.1, 10.0),
    )
    .with(
        "measured",
        Colour::Blue,
        points(&[
            (1.0, 0.0),
            (2.0, -1.0),
            (f64::NAN, 1.0),
            (3.0, f64::INFINITY),
            (11.0, 1.0),
            (4.0, 1.0),
        ]),
    );
    assert_eq!(discs(&figure.to_svg()).len(), 1);
}
