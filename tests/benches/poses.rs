//! Time to plan poses for the paper's robot, what random poses would give included.

#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use delta_cal::Noise;
use delta_cal_host::planning::poses::{PlanRequest, plan};
use delta_cal_host::{CalibrationMethod, InstrumentFacts, Record, RobotFile};
use delta_cal_tests::{paper_limits, paper_robot};
use std::hint::black_box;

fn planning(criterion: &mut Criterion) {
    let file = RobotFile {
        name: "paper".to_owned(),
        robot: paper_robot(),
        limits: paper_limits(),
        forearm_limit: None,
        tolerance: None,
        noise: Some(Noise::new(0.02, 0.002f64.to_radians()).unwrap()),
        sensor_frame: None,
        transmission: None,
        instruments: InstrumentFacts::default(),
        record: Record::default(),
    };
    let mut group = criterion.benchmark_group("plan");
    group.sample_size(10);
    for (name, method) in [
        ("IKM", CalibrationMethod::Ikm),
        ("FKM", CalibrationMethod::Fkm),
    ] {
        for count in [8, 12, 20, 60] {
            let request = PlanRequest {
                count,
                method,
                ..PlanRequest::new(&file)
            };
            // As many as were asked for, and better than random ones, or the time means nothing.
            let found = plan(&request).unwrap();
            assert_eq!(found.poses.len(), count);
            assert!(found.planned.bound < found.random.bound);
            group.bench_with_input(BenchmarkId::new(name, count), &request, |bench, request| {
                bench.iter(|| plan(black_box(request)).unwrap());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, planning);
criterion_main!(benches);
