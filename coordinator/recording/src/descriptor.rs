//! Protobuf types described by hand, where they depend on the scenario or are too few for a compiler of `.proto` files.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

/// A name that Protobuf accepts: letters, digits and `_`, not beginning with a digit.
pub(crate) fn identifier(part: &str) -> String {
    let fits = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' };
    let name: String = part.chars().map(fits).collect();
    match name.chars().next() {
        Some(c) if !c.is_ascii_digit() => name,
        _ => format!("_{name}"),
    }
}

/// A field that is absent when zero.
pub(crate) fn field(name: &str, number: u32, of: Type) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number as i32),
        label: Some(Label::Optional.into()),
        r#type: Some(of.into()),
        ..Default::default()
    }
}

/// A list of numbers.
pub(crate) fn repeated(name: &str, number: u32, of: Type) -> FieldDescriptorProto {
    FieldDescriptorProto { label: Some(Label::Repeated.into()), ..field(name, number, of) }
}

/// A field of a message type that is declared beside it.
pub(crate) fn nested(name: &str, number: u32, type_name: &str) -> FieldDescriptorProto {
    FieldDescriptorProto { type_name: Some(type_name.into()), ..field(name, number, Type::Message) }
}

/// A message type.
pub(crate) fn message(name: &str, fields: Vec<FieldDescriptorProto>) -> DescriptorProto {
    DescriptorProto { name: Some(name.into()), field: fields, ..Default::default() }
}

/// A file of message types, as a recording carries it.
pub(crate) fn file(package: &str, messages: Vec<DescriptorProto>) -> Vec<u8> {
    let file = FileDescriptorProto {
        name: Some(format!("{package}.{}.proto", messages.first().map_or("", |m| m.name()))),
        package: Some(package.into()),
        message_type: messages,
        syntax: Some("proto3".into()),
        ..Default::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}
