//! Tests of files of paths: columns, times, pauses and what is said of mistakes.

use super::*;

#[test]
fn waypoints_and_samples_are_read() {
    let places = "# a path\nx, y, z\n0.4,0.3,0.2\n\n0.5, -0.1, 0.3\n";
    let expected = vec![Point3::new(0.4, 0.3, 0.2), Point3::new(0.5, -0.1, 0.3)];
    let (speeds, lines) = (Vec::new(), vec![3, 5]);
    assert_eq!(parse(places), Ok(PathFile::Waypoints { places: expected.clone(), speeds, lines }));
    assert_eq!(parse(places).unwrap().places(), [(3, expected[0]), (5, expected[1])]);
    let timed = "t,x,y,z\n0,0.4,0.3,0.2\n1.5,0.5,-0.1,0.3\n";
    let sample = |time, [x, y, z]: [f64; 3]| Sample { time, position: Point3::new(x, y, z) };
    let expected = vec![sample(0.0, [0.4, 0.3, 0.2]), sample(1.5, [0.5, -0.1, 0.3])];
    assert_eq!(parse(timed), Ok(PathFile::Samples { samples: expected, lines: vec![2, 3] }));
}

#[test]
fn columns_come_in_any_order() {
    let places = vec![Point3::new(0.4, 0.3, 0.2)];
    let (speeds, lines) = (Vec::new(), vec![2]);
    let expected = PathFile::Waypoints { places: places.clone(), speeds, lines };
    assert_eq!(parse("z;y;x\n0,2;0,3;0,4\n"), Ok(expected));
    let samples = vec![Sample { time: 1.5, position: places[0] }];
    let expected = PathFile::Samples { samples, lines: vec![2] };
    assert_eq!(parse("z [m],y,t,x\n0.2,0.3,1.5,0.4\n"), Ok(expected));
}

#[test]
fn spreadsheets_of_other_languages_and_pauses_are_read() {
    let at = [[0.42, 0.24, 0.3], [0.54, 0.24, 0.3], [0.54, 0.24, 0.3]].map(Point3::from);
    let (places, speeds, lines) = (at.to_vec(), Vec::new(), vec![2, 3, 4]);
    let expected = Ok(PathFile::Waypoints { places, speeds, lines });
    let lines = "0.42,0.24,0.3\n0.54,0.24,0.3\n0.54,0.24,0.3\n";
    assert_eq!(parse(&format!("\u{feff}X,Y,Z\n{lines}")), expected);
    let commas = format!("x,y,z\n{lines}").replace(',', ";").replace('.', ",");
    assert_eq!(parse(&commas), expected);
    assert_eq!(parse(lines).unwrap().places(), [(1, at[0]), (2, at[1]), (3, at[2])]);
}

#[test]
fn a_mistake_is_named_with_its_line() {
    for (text, named) in [
        ("", "no places"),
        ("x,y,z\n", "no places"),
        ("0.4,o.3,0.2\n", "1: column y: 'o.3': must be a number"),
        ("0.4,0.3\n", "1: the columns are '0.4,0.3', but must be 'x,y,z'"),
        ("0,4,0,3,0,2\n", "1: the columns are '0,4,0,3,0,2', but must be 'x,y,z'"),
        ("0,4,0,3,0,2\n", "seconds): commas are the decimal sign and separate the columns"),
        ("0,0,4,0,3,0,2\n", "seconds): commas are the decimal sign and separate the columns"),
        ("0,1,1,1\n", "seconds): put a first line with these names before the numbers"),
        ("# t x y z\n0 0.4 0.3 0.2\n", "numpy: savetxt(…, delimiter=\",\", header=\"t,x,y,z\")"),
        ("x,y,z\r0.4,o.3,0.2\r", "2: column y: 'o.3': must be a number"),
        ("0.4,0.3,\n", "1: column z: '': must be a number"),
        ("X1;Y1;Z1\n", "seconds): 'X1' is unknown: write x, 'Y1' is unknown: write y"),
        ("0.4 0.3 0.2\n", "seconds): spaces do not separate columns: write 0.4,0.3,0.2"),
        ("0,4 0,3 0,2\n", "seconds): spaces do not separate columns: write 0,4;0,3;0,2"),
        ("X Y z_m\n1 1 1\n", "seconds): spaces do not separate columns: write X,Y,z_m"),
        ("my path\n1,1,1\n", "seconds): 'my path' is unknown, x is missing"),
        ("x,y,z,\n1,1,1,a\n", "2: 4 columns, but the first line names 3"),
        ("x,y,z\n1,1,1,,1\n", "2: 5 columns, but the first line names 3"),
        ("Nr;x;y;z\n1;1;1;1\n", "seconds): 'Nr' is unknown: remove the column"),
        ("X-Position;y;z\n0,7;1;1\n", "seconds): 'X-Position' is unknown: write x"),
        ("X-Koordinate;y;z\n0,7;1;1\n", "seconds): 'X-Koordinate' is unknown: write x"),
        ("x,y,z\n1;1;1\n", "2: the line separates its columns by semicolons, but the first"),
        ("x,y,z\n0,4;1;1\n", "line by commas: separate all by semicolons"),
        ("x;y;z\n0.4,1,1\n", "line by semicolons: separate all by commas"),
        ("x,y,z\n0.4 1 1\n", "2: spaces do not separate columns: write 0.4,1,1"),
        (",x,y,z\n0,1,1,1\n", "1: the columns are ',x,y,z', but must be 'x,y,z'"),
        (",x,y,z\n0,1,1,1\n", "seconds): column 1 has no name (pandas writes its index"),
        ("# t,x,y,z\n0,1,1,1\n0,1,1,1\n", "3: the time 0 s is not above"),
        ("# x_mm,y,z\n1,1,1\n", "1: the columns are 'x_mm,y,z', but must be 'x,y,z'"),
        ("a,b,c,d,e,f,g\n", "1: the columns are 'a,b,c,d, and 3 more', but must be 'x,y,z'"),
        ("time,x,y,z\n0,1,1,1\n", "seconds): 'time' is unknown: write t"),
        ("t_ms,x,y,z\n0,1,1,1\n", "): 't_ms' must be in seconds: convert it, and write t"),
        ("timestamp,x,y,z\n0,1,1,1\n", "seconds): 'timestamp' is unknown: write t"),
        ("[0.6, 0.25, 0.3]\n", "1: brackets do not belong to a table: write 0.6, 0.25, 0.3"),
        ("[[1,1,1],\n[1,1,1]]\n", "1: brackets do not belong to a table: write 1,1,1 (1 more"),
        ("x,y,z\n[0.6 1 1]\n", "2: brackets do not belong to a table: write 0.6,1,1"),
        ("x_mm,y,z\n1,1,1\n", "seconds): 'x_mm' must be in metres: convert it, and write x"),
        ("x,y,z\n# a\n0.4,0.3\n", "3: 2 columns, but the first line names 3"),
        ("x,y,z\n0.4,0.3\n1,1\n", "2: 2 columns, but the first line names 3 (1 more line too)"),
        ("x,y,z\n0.4,o.3,0.2\n", "2: column y: 'o.3': must be a number"),
        ("x,y,z\n0.4,0.3,inf\n", "2: column z: 'inf': must be a number"),
        ("x,y,z\n0.4,300,0.2\n", "2: column y: 300 m is out of range, ±100"),
        ("x,y,z\n420,240,300\n", "are these millimetres?"),
        ("z,y,x\n0.4,o.3,0.2\n", "2: column y: 'o.3': must be a number"),
        ("x,y,w\n0.4,0.3,0.2\n", "seconds): 'w' is unknown, z is missing"),
        ("t,x,y\n0,0.4,0.3\n", "seconds): z is missing"),
        ("x,y,z,y\n1,1,1,1\n", "seconds): y is there 2 times"),
        ("0,0.4,0.3,0.2\n", "1: the columns are '0,0.4,0.3,0.2', but must be 'x,y,z'"),
        ("t,x,y,z\n1,1,1,1\n1,2,1,1\n", "3: the time 1 s is not above"),
    ] {
        let error = parse(text).unwrap_err().to_string();
        assert!(error.contains(named), "{error}");
    }
}

#[test]
fn a_mistake_of_the_whole_file_is_named_once() {
    let lines = |line: &str| parse(&format!("x,y,z\n{}", line.repeat(3))).unwrap_err().to_string();
    let commas = "2: commas are the decimal sign and separate the columns too: write points \
                  (0.4,0.5,0.2), or separate the columns by semicolons (0,4;0,5;0,2)";
    assert_eq!(lines("0,4,0,5,0,2\n"), format!("{commas} (2 more lines too)"));
    assert_eq!(
        lines("420,240,30\n"),
        "2: column x: 420 m is out of range, ±100 (metres); are these millimetres? \
         (5 more numbers too)"
    );
    let timed = "t,x,y,z\n0,0,4,0,5,0,2\n";
    assert_eq!(parse(timed).unwrap_err().to_string(), commas);
}

#[test]
fn all_mistakes_are_named_at_once() {
    let error = parse("x,y,z\n0.4,o.3,nan\n0.4,0.3,0.2\n0.4\n").unwrap_err().to_string();
    assert_eq!(error.lines().count(), 3, "{error}");
    let many = format!("x,y,z\n{}", "0.4,o.3,0.2\n".repeat(1000));
    let error = parse(&many).unwrap_err().to_string();
    assert_eq!(error.lines().count(), MAX_LISTED + 1, "{error}");
    assert!(error.ends_with("980 more mistakes"), "{error}");
    let error = |lines: usize| parse(&format!("x,y,z\n{}", "0.4,o.3,0.2\n".repeat(lines)));
    let last =
        |lines| error(lines).unwrap_err().in_file("way.csv").lines().last().map(str::to_owned);
    assert_eq!(last(60).unwrap(), "way.csv: 40 more mistakes");
    assert_eq!(last(21).unwrap(), "way.csv: 1 more mistake");
}
