//! Tests of files of places: columns, times, pauses, and the lines and columns of mistakes.

use super::*;

fn positions(text: &str) -> Vec<[f64; 3]> {
    parse(text).unwrap().places.iter().map(|place| place.position.into()).collect()
}

#[test]
fn the_columns_decide_what_the_ball_does() {
    let text = "# a path\nx, y, z\n0.4,0.3,0.2\n\n0.5, -0.1, 0.3\n";
    let at = |line, x, y, z| Place::new(line, Point3::new(x, y, z));
    let places = vec![at(3, 0.4, 0.3, 0.2), at(5, 0.5, -0.1, 0.3)];
    assert_eq!(
        parse(text),
        Ok(Places { unit: Unit::Metres, kind: Kind::Path, places, speeds: Vec::new() })
    );
    let timed = parse("t,x,y,z\n0,0.4,0.3,0.2\n1.5,0.5,-0.1,0.3\n").unwrap();
    assert_eq!(timed.kind, Kind::Timed);
    assert_eq!(timed.places[1], Place { time_s: 1.5, ..at(3, 0.5, -0.1, 0.3) });
    let text = "x, y, z, dwell, tolerance\n0.4,0.3,0.2\n0.5, -0.1, 0.3, 2\n0.4,0.3,0.2,,0.02\n";
    let stops = parse(text).unwrap();
    assert_eq!(stops.kind, Kind::Stops);
    let expected = [
        at(2, 0.4, 0.3, 0.2),
        Place { dwell_s: 2.0, ..at(3, 0.5, -0.1, 0.3) },
        Place { tolerance_m: Some(0.02), ..at(4, 0.4, 0.3, 0.2) },
    ];
    assert_eq!(stops.places, expected);
    assert_eq!(parse("# x,y,z,dwell\n1,1,1,0\n").unwrap().kind, Kind::Stops);
    assert_eq!(parse("G1 X1 Y2 Z3\n").unwrap().kind, Kind::Path);
}

#[test]
fn columns_come_in_any_order_and_numbers_with_a_decimal_comma() {
    for text in [
        "z;y;x\n0,2;-0,1;0,4\n",
        "z [m],y,t,x\n0.2,-0.1,1.5,0.4\n",
        "\u{feff}Dwell [s];Z [m];Y;X (m)\n2;0,2;-0,1;0,4\n",
        "0,4;-0,1;0,2\n",
        "x in m;y/m;z [Meter];;\n0,4;-0,1;0,2;;\n",
        "x,y,z,dwell\n0.4,-0.1,0.2,,,\n",
        "# x,y,z\n0.4,-0.1,0.2,,\n",
        "0.4,-0.1,0.2,,\n",
        "x,y,z\r0.4,-0.1,0.2\r",
        "time,x,y,z\n0,0.4,-0.1,0.2\n",
        "# t x y z\n0 0.4 -0.1 0.2\n",
        "[0.4, -0.1, 0.2]\n",
        "[[0.4,-0.1,0.2],\n",
        "0.4 -0.1 0.2\n",
    ] {
        assert_eq!(positions(text), [[0.4, -0.1, 0.2]], "{text}");
    }
    let pause = "0.42,0.24,0.3\n0.54,0.24,0.3\n0.54,0.24,0.3\n";
    assert_eq!(positions(pause), [[0.42, 0.24, 0.3], [0.54, 0.24, 0.3], [0.54, 0.24, 0.3]]);
}

/// Each text with the line and the key of its first mistake; the key is empty where the mistake is
/// that of the whole line.
#[test]
fn a_mistake_is_named_with_its_line_and_column() {
    for (text, line, key) in [
        ("", 1, ""),
        ("x,y,z\n", 1, ""),
        ("0.4,o.3,0.2\n", 1, "y"),
        ("0.4,0.3\n", 1, "z"),
        ("0.2\n", 1, "y"),
        ("0,4,0,3,0,2\n", 1, ""),
        ("0,1,1,1\n", 1, ""),
        ("0.2,0.3,0.24,0.3\n", 1, ""),
        ("x,y,z\r0.4,o.3,0.2\r", 2, "y"),
        ("0.4,0.3,\n", 1, "z"),
        ("x,y,z\r1,1\r", 2, "z"),
        ("X1;Y1;Z1\n", 1, "X1"),
        ("0,4 0,3 0,2\n", 1, ""),
        ("my path\n1,1,1\n", 1, "my"),
        ("x,y,z,\n1,1,1,a\n", 2, ""),
        ("x,y,z\n1,1,1,,1\n", 2, ""),
        ("0.4,0.3,0.2\n0.4,0,3,0.2,1,1\n", 2, ""),
        ("Nr;x;y;z\n1;1;1;1\n", 1, "Nr"),
        ("x;y;z;comment\n", 1, "comment"),
        ("X-Position;y;z\n0,7;1;1\n", 1, "X-Position"),
        ("X in mm;y;z\n", 1, "X in mm"),
        ("x,y,z\n1;1;1\n", 2, "x"),
        ("x,y,z\n0,4;1;1\n", 2, "y"),
        ("x;y;z\n0.4,1,1\n", 2, "x"),
        ("x,y,z\n0.4 1 1\n", 2, "x"),
        (",x,y,z\n0,1,1,1\n", 1, ""),
        ("# x_mm,y,z\n1,1,1\n", 1, "x_mm"),
        ("x_mm,y,z\n1,1,1\n", 1, "x_mm"),
        ("a,b,c,d,e,f,g\n", 1, "a"),
        ("t_ms,x,y,z\n0,1,1,1\n", 1, "t_ms"),
        ("x,y,z\n# a\n0.4,0.3\n", 3, "z"),
        ("dwell,z,y,x\n1,0.4,0.3\n", 2, "x"),
        ("x,y,z\n0.4,0.3,inf\n", 2, "z"),
        ("nan,1,1\n", 1, "x"),
        ("x,y,z\n0.4,300,0.2\n", 2, "y"),
        ("420,240,300\n", 1, "x"),
        ("z,y,x\n0.4,o.3,0.2\n", 2, "y"),
        ("x,y,w\n0.4,0.3,0.2\n", 1, "w"),
        ("t,x,y\n0,0.4,0.3\n", 1, "z"),
        ("x,y,dwell\n0.4,0.3,0.2\n", 1, "z"),
        ("x,y,z,y\n1,1,1,1\n", 1, "y"),
        ("t,x,y,z,dwell\n0,1,1,1,1\n", 1, "t"),
        ("0,0.4,0.3,0.2\n", 1, ""),
        ("t,x,y,z\n1,1,1,1\n1,2,1,1\n", 3, "t"),
        ("# t,x,y,z\n0,1,1,1\n0,1,1,1\n", 3, "t"),
        ("t,x,y,z\n,1,1,1\n", 2, "t"),
        ("x,y,z,dwell\n1,1,1,-1\n", 2, "dwell"),
        ("x,y,z,tolerance\n1,1,1,0\n", 2, "tolerance"),
        ("frame,t_s,u_px,v_px\n0,0,,\n", 1, "frame"),
        ("[board]\nport = \"x\"\n", 1, "board"),
        ("G0 X500 Y300 Z300\nG2 X510 I5 J0\n", 2, ""),
    ] {
        let mistakes = parse(text).unwrap_err();
        assert_eq!(
            (mistakes[0].line, mistakes[0].key.as_str()),
            (line, key),
            "{text}: {mistakes:?}"
        );
    }
    let mistake = |text| parse(text).unwrap_err()[0].to_string();
    assert_eq!(mistake("1,o,1\n"), "`y = o` is wrong: must be a number, -100 to 100 m");
    assert!(mistake("420,1,1\n").contains("must be -100 to 100 m; is it in millimetres"));
    assert!(mistake("w,x,y,z\n").starts_with("`w` is wrong: no such column; columns are x, y, z"));
}

#[test]
fn all_mistakes_are_named_at_once() {
    let mistakes = parse("x,y,z\n0.4,o.3,nan\n0.4,0.3,0.2\n0.4\n").unwrap_err();
    let lines: Vec<usize> = mistakes.iter().map(|mistake| mistake.line).collect();
    assert_eq!(lines, [2, 2, 4, 4]);
}

#[test]
fn pixels_are_a_table_of_their_own() {
    let found = parse("u,v,dwell\n320.5,240,\n0,479.5,2\n").unwrap();
    assert_eq!((found.unit, found.kind), (Unit::Pixels, Kind::Stops));
    assert_eq!(found.places[1].position, Point3::new(0.0, 0.0, 479.5));
    assert_eq!(found.places[1].dwell_s, 2.0);
    let timed = parse("t,u,v\n0,1,2\n1,3,4\n").unwrap();
    assert_eq!((timed.unit, timed.kind), (Unit::Pixels, Kind::Timed));
    for (text, wrong) in [
        ("u,y\n1,2\n", "v"),
        ("u,v,z\n1,2,3\n", "z"),
        ("u,v,tolerance\n1,2,3\n", "tolerance"),
        ("u,v\n-1,2\n", "u"),
        ("u,v\n1,65536\n", "v"),
    ] {
        let mistakes = parse(text).unwrap_err();
        assert!(mistakes.iter().any(|mistake| mistake.key == wrong), "{text}: {mistakes:?}");
    }
}
