//! Tests of tables: names, separators, decimal commas and numbers.

use super::*;

const KNOWN: [&str; 5] = ["t", "x", "y", "z", "dwell"];

fn numbers(text: &str) -> (Option<Vec<String>>, Vec<Vec<Option<f64>>>) {
    let table = Table::of(text, &KNOWN);
    let names = table.names.as_ref();
    let names = names.map(|row| row.fields.iter().map(|name| column_name(name)).collect());
    let row = |row: &Row| row.fields.iter().map(|field| table.number(field)).collect();
    (names, table.rows.iter().map(row).collect())
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
        "x y z\n0.5 -0.25 3\n",
        "# x y z\n5.0e-01 -2.5e-01  3.0e+00\n",
        "# x y z\n0,5;-0,25;3\n",
        "x,y,z\n[0.5, -0.25, 3],\n",
        "x y z\n[0.5 -0.25 3]\n",
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
        "1,2,3\n# z,y,x\n",
    ] {
        let names = numbers(text).0;
        assert_eq!(names.is_some(), text.contains("\nx"), "{text}");
    }
    // Numbers in another unit are not read as metres.
    let table = Table::of("# a\n# t_ms,x,y,z\n0,1,2,3\n", &KNOWN);
    assert_eq!(table.names.unwrap().line, 2);
}

#[test]
fn other_units_stay_in_the_names() {
    let (names, _) = numbers("x [mm],y (cm),z [m,x_mm,y_k\n1,2,3,4,5\n");
    assert_eq!(names.unwrap(), ["x [mm]", "y (cm)", "z [m", "x_mm", "y_k"]);
    let (names, _) = numbers("t in s,t/s,t [seconds],T [sec],x in,x_second\n1,2,3,4,5,6\n");
    assert_eq!(names.unwrap(), ["t", "t", "t", "t", "x in", "x_second"]);
}

#[test]
fn a_line_has_its_number_in_the_text() {
    let table = Table::of("# a\n\n1,2\n\n3\n", &KNOWN);
    let lines: Vec<(usize, usize)> =
        table.rows.iter().map(|row| (row.line, row.fields.len())).collect();
    assert_eq!(lines, [(3, 2), (5, 1)]);
    let table = Table::of("# a\r\r1,2,3\r\r3,,,,\r", &KNOWN);
    let lines: Vec<(usize, usize)> =
        table.rows.iter().map(|row| (row.line, row.fields.len())).collect();
    assert_eq!(lines, [(3, 3), (5, 1)]);
}
