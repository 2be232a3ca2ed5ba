//! Tests of tables: names, separators, decimal commas and numbers.

use super::*;

fn numbers(text: &str) -> (Option<Vec<String>>, Vec<Vec<Option<f64>>>) {
    let mut table = Table::of(text);
    let names = table.take_names().map(|row| row.fields);
    let names = names.map(|names| names.iter().map(|name| column_name(name)).collect());
    let row = |row: &Row| row.fields.iter().map(|field| table.number(field)).collect();
    (names, table.rows().iter().map(row).collect())
}

#[test]
fn marks_names_separators_and_decimal_commas_are_read() {
    let names = Some(["x", "y", "z"].map(str::to_owned).to_vec());
    let row = vec![[0.5, -0.25, 3.0].map(Some).to_vec()];
    for text in [
        "\u{feff}x,y,z\n0.5,-0.25,3\n",
        "X, Y, Z\r\n# a comment\r\n\r\n0.5, -0.25, 3\r\n",
        "x;y;z\n0,5;-0,25;3,0\n",
        "x;y;z\n0.5;-0.25;3\n",
        "X [m], y (m), z[ m ]\n0.5, -0.25, 3\n",
        "X_m, y m, z_[m]\n0.5, -0.25, 3\n",
        "x\ty\tz\n0,5\t-0.25\t3\n",
        "x;y;z\n0,5;-0,25;3\n;;\n\"\";\"\";\"\"\n",
        "sep=;\nx;y;z\n0,5;-0,25;3\n",
        "SEP=,\r\nx,y,z\n0.5,-0.25,3\n",
        "\u{feff}\"sep=;\"\nx;y;z\n0.5;-0.25;3\n",
        "sep=\t\nx\ty\tz\n0,5\t-0,25\t3\n",
        "\"x\",\"y\",\"z\"\n\"0.5\",\"-0.25\",\"3\"\n",
        "# x,y,z\n5.000e-01,-2.500e-01,3.000e+00\n",
        "x in m;y in m;z in m\n0,5;-0,25;3\n",
        "x [metres],Y [Meter],z/m\n0.5,-0.25,3\n",
        "x / m,y_meters,z (metre)\n0.5,-0.25,3\n",
        "x;y;z;;\n0,5;-0,25;3;;\n",
        "x;y;z;;\n0,5;-0,25;3\n",
        "x,y,z\n0.5,-0.25,3,,\n",
        "# x,y,z,\n0.5,-0.25,3,\n",
        "x,y,z\r0.5,-0.25,3\r",
        "sep=;\r\r# a comment\rx;y;z\r0,5;-0,25;3",
        "# my path\n#X [m]; y; z\n\n0,5;-0,25;3\n# z;y;x\n",
    ] {
        assert_eq!(numbers(text), (names.clone(), row.clone()), "{text}");
    }
}

#[test]
fn a_line_of_numbers_has_no_names_and_what_is_no_number_is_none() {
    let (names, rows) = numbers("nan,1e-1,-2\nx,0,5;1\n1.5,1,000.5\n");
    assert_eq!((names, rows.len()), (None, 3));
    // "nan" begins no line of names, and is no finite number.
    assert_eq!(rows[0], [None, Some(0.1), Some(-2.0)]);
    assert_eq!(rows[1], [None, Some(0.0), None]);
    // A comma for thousands is not taken for a decimal comma.
    let (_, rows) = numbers("1;1,000.5;1,0,0\n");
    assert_eq!(rows, [[Some(1.0), None, None]]);
    assert_eq!(numbers(""), (None, vec![]));
}

#[test]
fn a_comment_has_names_only_above_the_numbers_and_if_it_has_nothing_else() {
    for text in [
        "# x,y,z\nx,y,z\n1,2,3\n",
        "# z,y,x\n# a comment\n1,2,3\n",
        "# x,y,z,dwell\n1,2,3\n",
        "# x,y,w\n1,2,3\n",
        "# x,x,y\n1,2,3\n",
        "1,2,3\n# z,y,x\n",
    ] {
        let names = numbers(text).0;
        assert_eq!(names.is_some(), text.contains("\nx"), "{text}");
    }
    let mut table = Table::of("# a\n# t_ms,x,y,z\n0,1,2,3\n");
    assert_eq!(table.take_names().unwrap().line, 2);
    assert_eq!(table.take_names(), None);
}

#[test]
fn other_units_stay_in_the_names() {
    let (names, _) = numbers("x [mm],y (cm),z [m,x_mm,y_k\n1,2,3,4,5\n");
    assert_eq!(names.unwrap(), ["x [mm]", "y (cm)", "z [m", "x_mm", "y_k"]);
    let (names, _) = numbers("t in s,t/s,t [seconds],T [sec],x in,x_second\n1,2,3,4,5,6\n");
    assert_eq!(names.unwrap(), ["t", "t", "t", "t", "x in", "x_second"]);
}

#[test]
fn decimal_commas_between_commas_are_known_by_too_many_whole_numbers() {
    for (line, is_it) in [
        ("0,4,0,5,0,2", true),
        ("0,4,-0,05,1", true),
        ("\"0,4\",\"0,5\",\"0,2\"", true),
        ("0,4,0", false),
        ("0.4,0,5,0,2", false),
        ("0,4,0,5,0,2,0,1", false),
        ("0,4,0,5,a", false),
        ("0,4;0,5;0,2;1;2;3", false),
    ] {
        let table = Table::of(line);
        assert_eq!(table.has_decimal_commas(&table.rows()[0], 3), is_it, "{line}");
    }
}

#[test]
fn wrong_names_of_columns_are_listed() {
    let wrong = |names: &str| {
        let names: Vec<String> = names.split(' ').map(str::to_owned).collect();
        wrong_names(&names, &["x", "y", "z", "dwell"], 3)
    };
    assert_eq!(wrong("x y w"), "'w' is unknown, z is missing");
    assert_eq!(wrong("x y z y"), "y is there 2 times");
    let convert = "'x[mm]' must be in metres: convert it, and write x";
    assert_eq!(wrong("x[mm] y z"), convert);
    assert_eq!(wrong("x[mm] w z"), format!("{convert}, 'w' is unknown, y is missing"));
    assert_eq!(wrong("x_mm y z"), "'x_mm' must be in metres: convert it, and write x");
    assert_eq!(wrong("x y z Nr"), "'Nr' is unknown: remove the column");
    assert_eq!(wrong("x y z zone"), "'zone' is unknown: remove the column");
    assert_eq!(wrong("X-Ist X-Soll y z"), "'X-Ist' is unknown, 'X-Soll' is unknown, x is missing");
    let columns = "'Nr' is unknown: remove the column, 'X-Position' is unknown: write x";
    assert_eq!(wrong("Nr X-Position y z"), columns);
    let convert = "'X-Pos[mm]' must be in metres: convert it, and write x";
    assert_eq!(wrong("X-Pos[mm] y z"), convert);
    assert_eq!(wrong("X_mm y z"), "'X_mm' must be in metres: convert it, and write x");
    assert_eq!(wrong(" x y z"), INDEX);
    assert_eq!(wrong("x  y z"), "column 2 has no name");
    assert_eq!(wrong("z y x"), "");
    let time = wrong_names(&["time", "x"].map(str::to_owned), &["t", "x"], 2);
    assert_eq!(time, "'time' is unknown: write t");
    let timed = |name: &str| wrong_names(&[name, "x"].map(str::to_owned), &["t", "x"], 2);
    assert_eq!(timed("timestamp"), "'timestamp' is unknown: write t");
    for name in ["t_ms", "time [ms]", "timestamp_ns"] {
        let says = format!("'{name}' must be in seconds: convert it, and write t");
        assert_eq!(timed(name), says);
    }
    let inches = wrong_names(&["X in inches".to_owned()], &["x"], 1);
    assert_eq!(inches, "'X in inches' must be in metres: convert it, and write x");
    let path = wrong_names(&["x", "y", "z", "dwell"].map(str::to_owned), &["x", "y", "z"], 3);
    assert_eq!(path, "'dwell' is for waypoints (`--waypoints`), not for a path");
}

#[test]
fn a_line_has_its_number_in_the_text() {
    let table = Table::of("# a\n\n1,2\n\n3\n");
    let lines: Vec<(u64, usize)> =
        table.rows().iter().map(|row| (row.line, row.fields.len())).collect();
    assert_eq!(lines, [(3, 2), (5, 1)]);
    let table = Table::of("# a\r\r1,2,3\r\r3,,,,\r");
    let lines: Vec<(u64, usize)> =
        table.rows().iter().map(|row| (row.line, row.fields.len())).collect();
    assert_eq!(lines, [(3, 3), (5, 3)]);
}
