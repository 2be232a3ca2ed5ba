use nalgebra::Point3;
use plumb_protocol::units::Micrometres;

use super::*;

/// Cable of a full step on the paper's rig, metres.
const STEP_M: f64 = NOMINAL_STEP_M;

fn parse(text: &str) -> Rig {
    parse_toml(Path::new("rig.toml"), text).unwrap()
}

#[test]
fn the_law_and_the_guards_have_defaults() {
    let tables = ["reached", "deadlines", "growth"];
    let without = PAPER
        .split("\n\n")
        .filter(|part| !tables.iter().any(|table| part.starts_with(&format!("[{table}]"))));
    let without = parse(&without.collect::<Vec<_>>().join("\n\n"));
    assert_eq!(without, Rig::paper().unwrap());
    assert_eq!(without.law, LawName::Taut.into());
    let one_key = PAPER.replace("radius = 0.010\n", "");
    assert_eq!(parse(&one_key), without);
}

#[test]
fn the_papers_workspace_keeps_targets_above_the_floor_and_beside_the_motors_out() {
    let rig = Rig::paper().unwrap();
    let workspace = rig.config().unwrap().workspace;
    for target in rig.targets().unwrap() {
        assert!(workspace.contains(target), "{target:?}");
    }
    for outside in [[0.4, -0.1, 0.3], [0.4, 0.3, -0.05], [0.4, 0.3, 0.66], [0.95, 0.3, 0.3]] {
        assert!(!workspace.contains(Point::from_metres(outside).unwrap()), "{outside:?}");
    }
}

/// The travel reaches every corner of the workspace, and little more.
#[test]
fn the_papers_travel_fits_its_workspace() {
    let rig = Rig::paper().unwrap();
    let simulation = rig.simulation.as_ref().unwrap();
    let corner = |n: usize| {
        let axis = |i: usize| if n >> i & 1 == 0 { rig.workspace.min } else { rig.workspace.max };
        Point3::from([0, 1, 2].map(|i| axis(i)[i].get()))
    };
    let steps = |motor: &Point3<f64>, ball: Point3<f64>| {
        ((ball - motor).norm() - (simulation.start() - motor).norm()) / STEP_M
    };
    let motors = simulation.motors();
    let all: Vec<f64> = (0..8)
        .flat_map(|n| motors.iter().map(move |motor| steps(motor, corner(n))).collect::<Vec<_>>())
        .collect();
    let least = all.iter().copied().fold(0.0, f64::min);
    let largest = all.iter().copied().fold(0.0, f64::max);
    let [min, max] = rig.motors.travel.map(|limit| limit.get());
    assert!((1.0..1.3).contains(&(min / least)), "{min} for {least}");
    assert!((1.0..1.3).contains(&(max / largest)), "{max} for {largest}");
}

/// Drivers and boards have their names in capitals on them.
#[test]
fn names_of_drivers_and_boards_are_read_in_any_case() {
    let drivers = [
        ("A4988", Driver::A4988),
        ("DRV8825", Driver::Drv8825),
        ("TMC2209", Driver::Tmc2209),
        ("Tb6600", Driver::Tb6600),
        ("DM542", Driver::Dm542),
        ("dm542", Driver::Dm542),
    ];
    for (name, driver) in drivers {
        let text = PAPER.replacen("\"a4988\"", &format!("{name:?}"), 1);
        assert_eq!(parse(&text).motors.driver, driver, "{name}");
    }
    let named = |name: &str| format!("[board]\nkind = {name:?}");
    for board in BoardName::ALL {
        let name = board.board().name.to_uppercase();
        let text = PAPER.replacen("[board]", &named(&name), 1);
        assert_eq!(parse(&text).board.kind, board, "{name}");
    }
    // The error about an unknown name quotes it. The name of a table has one spelling.
    let error = |from: &str, to: &str| {
        let text = PAPER.replacen(from, to, 1);
        Rig::parse(Path::new("rig.toml"), &text).unwrap_err().to_string()
    };
    let unknown = error("\"a4988\"", "\"TMC2208\"");
    assert!(unknown.contains("`TMC2208`") && unknown.contains("`tmc2209`"), "{unknown}");
    let key = error("\"a4988\"", "{ COILS = { duty = 0.5 } }");
    assert!(key.contains("`COILS`"), "{key}");
    let kind = error("[board]", &named("PICO3"));
    assert!(kind.contains("`PICO3`") && kind.contains("`pico2`"), "{kind}");
}

/// Stiff cables shorten the running mean of `taut` only, and never lengthen it.
#[test]
fn stiff_cables_shorten_the_running_mean() {
    let mean_ms = |stiffness: &str, law: LawName, mean: Option<f64>| {
        let text = format!("{PAPER}\n[cables]\nstiffness = \"{stiffness}\"\n");
        let mut rig = Rig::parse(Path::new("rig.toml"), &text).unwrap();
        rig.law = law.into();
        if let Some(mean) = mean {
            rig.law.set_mean(mean.try_into().unwrap());
        }
        rig.config().unwrap().mean.0
    };
    assert_eq!(mean_ms("unknown", LawName::Taut, None), 400);
    assert_eq!(mean_ms("soft", LawName::Taut, None), 400);
    assert_eq!(mean_ms("stiff", LawName::Taut, None), 250);
    assert_eq!(mean_ms("stiff", LawName::Taut, Some(0.1)), 100);
    assert_eq!(mean_ms("stiff", LawName::Interval, Some(0.3)), 300);
}

#[test]
fn the_places_of_a_simulated_rig_are_exact_and_measured_ones_approximate() {
    let rig = Rig::paper().unwrap();
    let exact = rig.motor_points().unwrap();
    assert_eq!((exact.is_approximate, exact.names()), (false, ["A", "B", "C"]));
    let unknown = Rig { simulation: None, size: None, ..rig.clone() };
    assert_eq!(unknown.motor_points(), None);
    let size: Size = toml::from_str(
        "motors = [[1.0, 0.7, 0.6], [1.0, 0.0, 0.6], [0.0, 0.4, 0.6]]\n\
         cable_per_step = 0.0005",
    )
    .unwrap();
    let measured = Rig { size: Some(size), ..unknown }.motor_points().unwrap();
    assert_eq!((measured.is_approximate, measured.names()[2]), (true, "C (approximate)"));
    assert_eq!(measured.places[1], Point3::new(1.0, 0.0, 0.6));
}

/// Motors that do not stand as the rig frame demands, and a drum that no motor has, are a mistake:
/// no law begins with them.
#[test]
fn the_law_taut_begins_with_a_size_that_can_be_true() {
    let size = |motors: &str, cable: &str| -> Size {
        toml::from_str(&format!("motors = {motors}\ncable_per_step = {cable}")).unwrap()
    };
    const TRUE: &str = "[[0.85, 0.61, 0.665], [0.85, 0.0, 0.665], [0.0, 0.24, 0.665]]";
    const EXCHANGED: &str = "[[0.85, 0.0, 0.665], [0.85, 0.61, 0.665], [0.0, 0.24, 0.665]]";
    let prior = |size, law: LawName| {
        Rig { size: Some(size), law: law.into(), ..Rig::paper().unwrap() }.prior()
    };
    let Some(Prior::Rig(rig)) = prior(size(TRUE, "0.000471"), LawName::Taut) else {
        panic!("no prior")
    };
    assert_eq!(rig.motors[1], Point([850_000, 0, 665_000].map(Micrometres)));
    assert_eq!((rig.cable_per_step[2], rig.deviation), (471_000, Micrometres(20_000)));
    assert_eq!(prior(size(TRUE, "0.000471"), LawName::Adaptive), None);
    assert_eq!(prior(size(EXCHANGED, "0.000471"), LawName::Taut), None);
    assert_eq!(prior(size(TRUE, "0.1"), LawName::Taut), None);
    assert_eq!(Rig { size: None, ..Rig::paper().unwrap() }.prior(), None);
}
