//! The tables of the page on the wire format against the types of the messages: each variant and
//! type has its row, with its fields in their order. The types tell this by their schema, whose
//! hash a Hello carries.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use plumb_protocol::message::{Command, FromBoard, ToBoard};
use plumb_tests::source_tree::{read, root};
use postcard_schema::Schema;
use postcard_schema::schema::{
    DataModelType as Model, DataModelVariant as Contents, NamedType, NamedValue, NamedVariant,
};

/// A row of a table: how it begins, and the inline code in the cells after that.
type Row = (String, Vec<String>);

/// Returns the types that a variant contains.
fn contents(variant: &NamedVariant) -> Vec<&'static NamedType> {
    match *variant.ty {
        Contents::UnitVariant => Vec::new(),
        Contents::NewtypeVariant(one) => vec![one],
        Contents::TupleVariant(types) => types.to_vec(),
        Contents::StructVariant(_) => panic!("{}: the page shows no names there", variant.name),
    }
}

/// Returns the types that a type contains, without those that they contain in turn.
fn parts(of: &NamedType) -> Vec<&'static NamedType> {
    match *of.ty {
        Model::Option(one) | Model::NewtypeStruct(one) | Model::Seq(one) => vec![one],
        Model::Tuple(types) | Model::TupleStruct(types) => types.to_vec(),
        Model::Struct(fields) => fields.iter().map(|field| field.ty).collect(),
        Model::Enum(variants) => variants.iter().flat_map(|variant| contents(variant)).collect(),
        _ => Vec::new(),
    }
}

/// Returns every type in the messages of both directions, each once.
fn all_types() -> Vec<&'static NamedType> {
    let mut found = vec![ToBoard::SCHEMA, FromBoard::SCHEMA];
    let mut next = 0;
    while let Some(of) = found.get(next) {
        for part in parts(of) {
            if !found.contains(&part) {
                found.push(part);
            }
        }
        next += 1;
    }
    found
}

/// Returns how the page writes a type: `[Option<u16>; 3]`.
fn written(of: &NamedType) -> String {
    match *of.ty {
        Model::Option(one) => format!("Option<{}>", written(one)),
        Model::Tuple([first, rest @ ..]) if rest.iter().all(|it| it == first) => {
            format!("[{}; {}]", written(first), rest.len() + 1)
        }
        Model::Seq(one) => format!("[{}]", written(one)),
        Model::Tuple(_) => panic!("{}: the page has no such type", of.name),
        _ => of.name.to_owned(),
    }
}

fn written_fields(fields: &[&NamedValue]) -> Vec<String> {
    fields.iter().map(|field| format!("{}: {}", field.name, written(field.ty))).collect()
}

/// Returns the struct's fields where a variant of a message is the only user of that struct: the
/// page has them in the variant's row.
fn own_fields(
    variant: &NamedVariant,
    all: &[&NamedType],
) -> Option<&'static [&'static NamedValue]> {
    let Contents::NewtypeVariant(content) = *variant.ty else { return None };
    let Model::Struct(fields) = *content.ty else { return None };
    let users = all.iter().flat_map(|of| parts(of)).filter(|part| *part == content).count();
    (users == 1).then_some(fields)
}

fn variants(of: &NamedType) -> &'static [&'static NamedVariant] {
    let Model::Enum(variants) = *of.ty else { panic!("{} is no enum", of.name) };
    variants
}

/// Returns the rows of the messages of one direction.
fn message_rows(of: &NamedType) -> Vec<Row> {
    let all = all_types();
    let row = |(number, variant): (usize, &&NamedVariant)| {
        let fields = own_fields(variant, &all).map(written_fields);
        let types = || contents(variant).into_iter().map(written).collect();
        (format!("{number} {}", variant.name), fields.unwrap_or_else(types))
    };
    variants(of).iter().enumerate().map(row).collect()
}

/// Returns how the page writes the variants of an enum: `2 Pin(Line, PinError)`.
fn written_variants(of: &NamedType) -> Vec<String> {
    let write = |(number, variant): (usize, &&NamedVariant)| {
        let types: Vec<String> = contents(variant).into_iter().map(written).collect();
        let fields =
            if types.is_empty() { String::new() } else { format!("({})", types.join(", ")) };
        format!("{number} {}{fields}", variant.name)
    };
    variants(of).iter().enumerate().map(write).collect()
}

/// Returns the rows of the types of one kind, for which `code` returns the inline code. The tables
/// of the messages have the commands, the messages and their own fields.
fn type_rows(code: impl Fn(&NamedType) -> Option<Vec<String>>) -> Vec<Row> {
    let all = all_types();
    let messages = [Command::SCHEMA, FromBoard::SCHEMA];
    let is_shown_there = |of: &NamedType| {
        let mut variants = messages.iter().flat_map(|message| variants(message));
        messages.contains(&of)
            || variants.any(|it| contents(it) == [of] && own_fields(it, &all).is_some())
    };
    let others = all.iter().filter(|of| !is_shown_there(of));
    others.filter_map(|of| Some((of.name.to_owned(), code(of)?))).collect()
}

/// Returns the rows of the table below a heading. The first `columns` cells are their beginnings.
fn page_rows(heading: &str, columns: usize) -> Vec<Row> {
    let page = read(&root().join("docs/understand/wire-format.md"));
    let (_, rest) = page.split_once(&format!("\n### {heading}\n")).expect(heading);
    let section = rest.split("\n#").next().unwrap_or_default();
    let table = section.lines().filter(|line| line.starts_with('|'));
    let row = |line: &str| {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let (begin, others) = cells.split_at(columns);
        let code = others.join(" ").split('`').skip(1).step_by(2).map(str::to_owned).collect();
        (begin.join(" "), code)
    };
    table.skip(2).map(row).collect()
}

/// Checks that the page has these rows and no others.
fn assert_rows(heading: &str, found: &[Row], expected: &[Row]) {
    let only_in = |one: &[Row], other: &[Row]| -> Vec<String> {
        let rows = one.iter().filter(|row| !other.contains(row));
        rows.map(|(begin, code)| format!("{begin} | {}", code.join(", "))).collect()
    };
    assert!(
        found == expected,
        "docs/understand/wire-format.md, {heading}: other rows than the code, or another order\n\
         only in the page: {:#?}\nonly in the code: {:#?}",
        only_in(found, expected),
        only_in(expected, found)
    );
}

/// Checks the rows of types, which the page has in an order of its own.
fn assert_types(heading: &str, code: impl Fn(&NamedType) -> Option<Vec<String>>) {
    let (mut found, mut expected) = (page_rows(heading, 1), type_rows(code));
    found.sort();
    expected.sort();
    assert_rows(heading, &found, &expected);
}

#[test]
fn the_page_has_every_command_with_its_number_and_fields() {
    let commands = message_rows(Command::SCHEMA);
    assert!(commands.contains(&("5 Target".to_owned(), vec!["Point".to_owned()])));
    assert_rows("Commands", &page_rows("Commands", 2), &commands);
}

#[test]
fn the_page_has_every_message_of_a_board_with_its_number_and_fields() {
    let heading = "Messages of the board";
    assert_rows(heading, &page_rows(heading, 2), &message_rows(FromBoard::SCHEMA));
}

#[test]
fn the_page_has_every_quantity_with_its_bytes() {
    assert_types("Quantities", |of| match *of.ty {
        Model::NewtypeStruct(one) => Some(vec![written(one)]),
        _ => None,
    });
}

#[test]
fn the_page_has_every_struct_with_its_fields() {
    assert_types("Structs", |of| match *of.ty {
        Model::Struct(fields) => Some(written_fields(fields)),
        Model::TupleStruct(_) => panic!("{}: the page shows no such struct", of.name),
        _ => None,
    });
}

#[test]
fn the_page_has_every_enum_with_the_numbers_of_its_variants() {
    assert_types("Enums", |of| matches!(of.ty, Model::Enum(_)).then(|| written_variants(of)));
}

/// The numbers in the schema are the order of the variants. They are also those in the bytes.
#[test]
fn the_numbers_of_the_variants_are_their_first_bytes() {
    for (number, variant) in variants(Command::SCHEMA).iter().enumerate() {
        let bytes = [vec![u8::try_from(number).expect("a small number")], vec![1; 240]].concat();
        let (command, _) = postcard::take_from_bytes::<Command>(&bytes).expect(variant.name);
        let debug = format!("{command:?}");
        assert_eq!(debug.split(['(', ' ']).next(), Some(variant.name), "{number}");
    }
}
