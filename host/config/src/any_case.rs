//! Names that a person may write in any case.

use std::fmt;

use serde::de::{Deserialize, DeserializeSeed, Deserializer, EnumAccess, Error, Visitor};
use serde::forward_to_deserialize_any;

/// Reads an enum. Each of its `names` may be written in any case; other names, such as those of
/// tables, must be written as they are.
///
/// # Errors
/// Those of `T`. The error about an unknown name quotes it from the file.
///
/// ```
/// use plumb_config::any_case::any_case;
/// use serde::{Deserialize, Deserializer};
///
/// #[derive(Debug, PartialEq, Deserialize)]
/// #[serde(rename_all = "lowercase")]
/// enum Chip {
///     Rp2040,
/// }
///
/// #[derive(Deserialize)]
/// struct File {
///     #[serde(deserialize_with = "chip")]
///     chip: Chip,
/// }
///
/// fn chip<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Chip, D::Error> {
///     any_case(deserializer, &["rp2040"])
/// }
///
/// let file: File = toml::from_str("chip = \"RP2040\"")?;
/// assert_eq!(file.chip, Chip::Rp2040);
/// # Ok::<(), toml::de::Error>(())
/// ```
pub fn any_case<'de, T, D>(deserializer: D, names: &'static [&'static str]) -> Result<T, D::Error>
where
    T: Deserialize<'de>,
    D: Deserializer<'de>,
{
    T::deserialize(AnyCase { inner: deserializer, names })
}

/// Part of the reading of an enum, on whose way to `inner` the name gets its own case.
struct AnyCase<T> {
    inner: T,
    names: &'static [&'static str],
}

impl<T> AnyCase<T> {
    /// Returns `inner` with the names of this one.
    fn with<U>(&self, inner: U) -> AnyCase<U> {
        AnyCase { inner, names: self.names }
    }
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for AnyCase<D> {
    type Error = D::Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.inner.deserialize_any(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        let visitor = self.with(visitor);
        self.inner.deserialize_enum(name, variants, visitor)
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        let visitor = self.with(visitor);
        self.inner.deserialize_identifier(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option
        unit unit_struct newtype_struct seq tuple tuple_struct map struct ignored_any
    }
}

impl<'de, V: Visitor<'de>> Visitor<'de> for AnyCase<V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.inner.expecting(f)
    }

    fn visit_enum<A: EnumAccess<'de>>(self, access: A) -> Result<V::Value, A::Error> {
        let access = self.with(access);
        self.inner.visit_enum(access)
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<V::Value, E> {
        let own = self.names.iter().find(|own| own.eq_ignore_ascii_case(name));
        self.inner.visit_str(own.copied().unwrap_or(name))
    }
}

impl<'de, A: EnumAccess<'de>> EnumAccess<'de> for AnyCase<A> {
    type Error = A::Error;
    type Variant = A::Variant;

    fn variant_seed<S: DeserializeSeed<'de>>(
        self,
        seed: S,
    ) -> Result<(S::Value, A::Variant), A::Error> {
        let seed = self.with(seed);
        self.inner.variant_seed(seed)
    }
}

impl<'de, S: DeserializeSeed<'de>> DeserializeSeed<'de> for AnyCase<S> {
    type Value = S::Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<S::Value, D::Error> {
        let deserializer = self.with(deserializer);
        self.inner.deserialize(deserializer)
    }
}
