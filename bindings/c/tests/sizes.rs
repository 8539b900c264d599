//! How much memory the objects are given, and how much of it they take here.

#[test]
fn every_object_fits_its_memory_in_c() {
    for kind in delta_cal_c::kind::ALL {
        for (number, size, taken) in kind.scalars {
            println!("{number:#x} {} {size} {taken}", kind.in_c);
            assert!(taken <= size);
        }
    }
}
