//! Enumerations whose values have names in scene files.

/// Declares an enumeration with a name for each value, in the order in which messages list them.
macro_rules! named {
    ($(#[$about:meta])* pub enum $type:ident {
        $($(#[$meaning:meta])* $value:ident = $name:literal,)+
    }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum $type { $($(#[$meaning])* $value),+ }

        impl $type {
            /// Names in scene files.
            pub const NAMES: [(&'static str, $type); [$($name),+].len()] =
                [$(($name, $type::$value)),+];

            /// Returns the name in scene files.
            pub fn name(self) -> &'static str {
                match self { $($type::$value => $name),+ }
            }
        }
    };
}

pub(super) use named;
