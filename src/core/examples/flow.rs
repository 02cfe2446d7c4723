//! A flow by itself: one smooth phase of a plate, whose monitors are enclosed between two polynomials.
//!
//!     cargo run --release -p signorini-core --example flow

use signorini_core::fem::Material;
use signorini_core::flow::{Flow, Layout, Modal};
use signorini_core::model::Model;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let plate = Model::plate([1.0, 0.3], [10, 3], Material::plate(1.0, 0.3, 1.0, 1.0));
    let system = plate.hold("left", &[0, 1]).obstacle("right", 1.0).build()?;
    let start = system.state_of(|x| [-1.5 * x[0], 0.0, 0.0], |_| [0.0; 3]);
    let phase = system.open_phase();
    let layout = Layout::new(&system);
    let mut y = [start.u.clone(), start.v.clone()].concat();
    y.resize(layout.len(), 0.0);

    // window by window: inside one the state is known at every time
    let mut flow = Modal::new(&system);
    flow.begin(&phase, 0.0, &y);
    flow.advance(&phase, 3.0)?;
    let (a, b) = flow.window();
    println!("first window: {a} to {b:.6}, by {}", flow.name());
    let middle = 0.5 * (a + b);
    flow.state(middle, &mut y);
    let gap = phase.monitor_values(middle, layout.u(&y), layout.v(&y))[0];
    let e = flow.enclose(0, a, b);
    println!(
        "gap of the first contact node there: {gap:.12}, enclosure {:.12} ± {:.1e}",
        e.polynomial.at(0.5),
        e.error
    );
    assert!((e.polynomial.at(0.5) - gap).abs() <= e.error + 1e-13);
    Ok(())
}

#[test]
fn runs() {
    main().unwrap();
}
