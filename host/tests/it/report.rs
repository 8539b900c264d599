//! `delta-cal calibrate --report`: one self-contained file with every number.

mod advice;
mod numbers;
mod outputs;

use crate::support::{Folder, NOISE, NOMINAL, TOLERANCE, csv, noisy, true_arms};
use roxmltree::Document;

fn folder(robot: &str, samples: &str) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", robot);
    folder.write("samples.csv", samples);
    folder
}

/// Every drawing of the page.
fn drawings(page: &str) -> Vec<&str> {
    page.match_indices("<svg")
        .map(|(start, _)| {
            let end = start + page[start..].find("</svg>").unwrap() + "</svg>".len();
            &page[start..end]
        })
        .collect()
}

/// The cells of each row of the page's tables.
fn rows(page: &str) -> Vec<Vec<String>> {
    page.match_indices("<tr")
        .map(|(start, _)| {
            let end = start + page[start..].find("</tr>").unwrap() + "</tr>".len();
            let document = Document::parse(&page[start..end]).unwrap();
            let cells = document.root_element().children();
            let text = |cell: roxmltree::Node<'_, '_>| {
                cell.descendants()
                    .filter(roxmltree::Node::is_text)
                    .filter_map(|node| node.text())
                    .collect()
            };
            cells.map(text).collect()
        })
        .collect()
}

#[test]
fn every_sample_is_drawn_in_every_view() {
    let folder = folder(NOMINAL, &csv(&noisy(&true_arms(), 30, 0.01)));
    folder
        .run("calibrate robot.toml samples.csv --report report.html")
        .ok();
    let page = folder.read("report.html");
    let discs: Vec<_> = drawings(&page)
        .into_iter()
        .map(|drawing| {
            let document = Document::parse(drawing).unwrap();
            document
                .descendants()
                .filter(|node| node.tag_name().name() == "circle")
                .count()
        })
        .collect();
    // With those of the legends: parameters, before and after, in σ those after only, three arms'
    // closure errors without legends, four views, conditions, four maps without any, joints; the joints of the
    // arms in the drawing that explains the parameters.
    let mut expected = vec![24 + 3, 60 + 2, 31, 30, 30, 30, 31, 31, 31, 31, 3 + 1];
    expected.extend([0; 4]);
    expected.extend([90 + 1, 10]);
    assert_eq!(discs, expected);
}

#[test]
fn the_page_fetches_nothing_and_runs_nothing() {
    let folder = folder(NOMINAL, &csv(&noisy(&true_arms(), 20, 0.01)));
    folder
        .run("calibrate robot.toml samples.csv --report report.html")
        .ok();
    // Every drawing names its language by an address that nothing is fetched from.
    let page = folder
        .read("report.html")
        .replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for part in [
        "http:", "https:", "//", "<script", "<link", "<img", "url(", "@import", "src=", "href=",
    ] {
        assert!(!page.contains(part), "{part}");
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let folder = folder(
        &format!("{NOMINAL}{TOLERANCE}"),
        &csv(&noisy(&true_arms(), 20, 0.01)),
    );
    for name in ["first.html", "second.html"] {
        let arguments = format!("calibrate robot.toml samples.csv --report {name}");
        let date = [("SOURCE_DATE_EPOCH", "0")];
        folder.run_where(&arguments, "", &date).ok();
    }
    assert_eq!(folder.read("first.html"), folder.read("second.html"));
}

#[test]
#[cfg(unix)]
fn file_names_are_escaped() {
    let folder = folder(NOMINAL, "");
    let samples = csv(&noisy(&true_arms(), 20, 0.01));
    folder.write("<i>&\"'samples.csv", samples);
    folder
        .run("calibrate robot.toml <i>&\"'samples.csv --report report.html")
        .ok();
    let page = folder.read("report.html");
    assert!(
        page.contains("&lt;i&gt;&amp;&quot;'samples.csv"),
        "{page:.3000}"
    );
    assert!(!page.contains("<i>"));
}
