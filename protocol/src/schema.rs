//! Identifier of the message types: a hash of the names of fields and variants, their types and
//! their order.

use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType, DataModelVariant, NamedType, NamedValue};

/// Enums that grow at their end, each with the number of variants that the identifier covers.
///
/// A variant beyond them leaves the identifier as it is. A program that does not know it takes the
/// message that carries it for malformed, and does nothing. Where [`VERSION`](crate::VERSION)
/// changes, the numbers follow.
const GROWING: &[(&str, usize)] = &[
    ("Command", 20),
    ("Law", 4),
    ("Prior", 2),
    ("Drivers", 4),
    ("FromBoard", 9),
    ("Refusal", 24),
    ("ConfigField", 22),
    ("Fault", 14),
    ("DriverFault", 9),
    ("WiringError", 8),
    ("StartCause", 7),
    ("BoardKind", 4),
];

/// Returns the identifier of `T`.
pub(crate) const fn of<T: Schema>() -> [u8; 8] {
    hash_type(BASIS, T::SCHEMA).to_le_bytes()
}

/// Offset basis of FNV-1a with 64 bits (RFC 9923, section 5).
const BASIS: u64 = 0xcbf2_9ce4_8422_2325;
/// Prime of FNV-1a with 64 bits (RFC 9923, section 5).
const PRIME: u64 = 0x0000_0100_0000_01b3;

const fn hash_byte(state: u64, byte: u8) -> u64 {
    (state ^ byte as u64).wrapping_mul(PRIME)
}

/// Hashes a name and its end.
const fn hash_name(mut state: u64, name: &str) -> u64 {
    let mut i = 0;
    while i < name.len() {
        state = hash_byte(state, name.as_bytes()[i]);
        i += 1;
    }
    hash_byte(state, 0)
}

const fn hash_type(state: u64, named: &NamedType) -> u64 {
    let state = hash_name(state, named.name);
    match named.ty {
        DataModelType::Option(of) | DataModelType::NewtypeStruct(of) | DataModelType::Seq(of) => {
            hash_type(state, of)
        }
        DataModelType::Tuple(of) | DataModelType::TupleStruct(of) => hash_types(state, of),
        DataModelType::Struct(fields) => hash_fields(state, fields),
        DataModelType::Enum(variants) => {
            let (mut state, mut i) = (state, 0);
            while i < covered(named.name, variants.len()) {
                state = hash_variant(hash_name(state, variants[i].name), variants[i].ty);
                i += 1;
            }
            hash_byte(state, 0)
        }
        // The name of a type without parts tells it: `u16`, `bool`.
        _ => state,
    }
}

const fn hash_types(mut state: u64, types: &[&NamedType]) -> u64 {
    let mut i = 0;
    while i < types.len() {
        state = hash_type(state, types[i]);
        i += 1;
    }
    hash_byte(state, 0)
}

const fn hash_fields(mut state: u64, fields: &[&NamedValue]) -> u64 {
    let mut i = 0;
    while i < fields.len() {
        state = hash_type(hash_name(state, fields[i].name), fields[i].ty);
        i += 1;
    }
    hash_byte(state, 0)
}

const fn hash_variant(state: u64, variant: &DataModelVariant) -> u64 {
    match variant {
        DataModelVariant::UnitVariant => hash_byte(state, 0),
        DataModelVariant::NewtypeVariant(of) => hash_type(state, of),
        DataModelVariant::TupleVariant(of) => hash_types(state, of),
        DataModelVariant::StructVariant(fields) => hash_fields(state, fields),
    }
}

/// Returns how many variants of the enum `name`, which has `len`, the identifier covers.
const fn covered(name: &str, len: usize) -> usize {
    let mut i = 0;
    while i < GROWING.len() {
        let (growing, first) = GROWING[i];
        if is_same(growing, name) {
            assert!(first <= len, "an enum of the wire has lost a variant");
            return first;
        }
        i += 1;
    }
    len
}

const fn is_same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Declares an enum `Prior`, of which two variants are covered, in a module, and returns its
    /// identifier.
    macro_rules! identifier {
        ($name:ident { $($variants:tt)* }) => {{
            #[derive(Schema)]
            #[expect(dead_code, reason = "only its schema is used")]
            enum $name { $($variants)* }
            of::<Option<$name>>()
        }};
    }

    #[test]
    fn only_a_variant_beyond_those_that_are_covered_keeps_the_identifier() {
        let known = identifier!(Prior { A, B(u8) });
        assert_eq!(identifier!(Prior { A, B(u8), C { x: u32 } }), known);
        assert_ne!(identifier!(Prior { C { x: u32 }, A, B(u8) }), known);
        assert_ne!(identifier!(Prior { A, B(i8) }), known);
        assert_ne!(identifier!(Prior { B(u8), A }), known);
        assert_ne!(identifier!(Prior { A, Other(u8) }), known);
        assert_ne!(identifier!(Other { A, B(u8) }), known);
        assert_ne!(identifier!(Other { A, B(u8), C }), identifier!(Other { A, B(u8) }));
    }

    /// A struct's fields, and the length of an array, are part of it.
    #[test]
    fn fields_and_lengths_change_the_identifier() {
        mod two {
            #[derive(postcard_schema::Schema)]
            #[expect(dead_code, reason = "only its schema is used")]
            pub(super) struct Pair {
                a: u8,
                b: u8,
            }
        }
        mod exchanged {
            #[derive(postcard_schema::Schema)]
            #[expect(dead_code, reason = "only its schema is used")]
            pub(super) struct Pair {
                b: u8,
                a: u8,
            }
        }
        assert_ne!(of::<two::Pair>(), of::<exchanged::Pair>());
        assert_ne!(of::<[u8; 3]>(), of::<[u8; 4]>());
        assert_ne!(of::<([u8; 3], u8)>(), of::<([u8; 2], [u8; 2])>());
    }
}
