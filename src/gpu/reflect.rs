//! What a SPIR-V module says of itself: workgroup size, push constants, storage buffers and how it
//! touches them.

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{BuiltIn, Decoration, ExecutionMode, Op, StorageClass};

use crate::error::{Error, Result};

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reflection {
    pub local_size: [u32; 3],
    pub push: Option<Struct>,
    /// By binding number; set 0 only, which is all that nimbus uses.
    pub bindings: Vec<Binding>,
    /// Bytes of workgroup-shared memory.
    pub shared_bytes: u32,
}

/// Members with their byte offset and size; names are empty where the compiler stripped them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Struct {
    pub name: String,
    pub bytes: u32,
    pub members: Vec<Member>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    pub name: String,
    pub offset: u32,
    pub bytes: u32,
}

/// How a shader asks for a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BindingKind {
    /// `buffer`: read and written as records.
    Storage,
    /// `usamplerBuffer`: read only, four words at a time.
    Texels,
    /// `samplerBuffer`: read only, float by float.
    Floats,
}

impl BindingKind {
    /// Of one texel; 0 for records, whose block tells.
    pub fn texel_bytes(self) -> u32 {
        match self {
            BindingKind::Storage => 0,
            BindingKind::Texels => 16,
            BindingKind::Floats => 4,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    pub binding: u32,
    pub kind: BindingKind,
    pub name: String,
    pub reads: bool,
    pub writes: bool,
    /// Bytes from one element of the block's runtime array to the next.
    pub stride: u32,
    /// The element, where it is a struct.
    pub element: Option<Struct>,
}

/// Reflects a module of one entry point.
pub fn reflect(name: &str, words: &[u32]) -> Result<Reflection> {
    let module = rspirv::dr::load_words(words)
        .map_err(|e| Error::Shader { name: name.to_owned(), what: format!("SPIR-V: {e}") })?;
    let m = Reader { module: &module };
    let mut found = Reflection { local_size: m.local_size(), ..Reflection::default() };
    for variable in module.types_global_values.iter().filter(|i| i.class.opcode == Op::Variable) {
        let (Some(id), Some(Operand::StorageClass(class))) =
            (variable.result_id, variable.operands.first())
        else {
            continue;
        };
        let pointee = variable.result_type.and_then(|t| m.pointee(t));
        let Some(pointee) = pointee else { continue };
        match class {
            StorageClass::PushConstant => found.push = Some(m.structure(pointee)),
            StorageClass::StorageBuffer => found.bindings.push(m.binding(id, pointee)),
            StorageClass::UniformConstant => found.bindings.push(m.texels(id, pointee)),
            StorageClass::Workgroup => found.shared_bytes += m.size(pointee, None),
            _ => {}
        }
    }
    found.bindings.sort_by_key(|b| b.binding);
    Ok(found)
}

struct Reader<'a> {
    module: &'a Module,
}

impl Reader<'_> {
    fn definition(&self, id: u32) -> Option<&Instruction> {
        self.module.types_global_values.iter().find(|i| i.result_id == Some(id))
    }

    fn id(&self, i: &Instruction, operand: usize) -> Option<u32> {
        match i.operands.get(operand) {
            Some(Operand::IdRef(id)) => Some(*id),
            _ => None,
        }
    }

    fn literal(&self, i: &Instruction, operand: usize) -> u32 {
        match i.operands.get(operand) {
            Some(Operand::LiteralBit32(v)) => *v,
            _ => 0,
        }
    }

    fn pointee(&self, pointer: u32) -> Option<u32> {
        let i = self.definition(pointer)?;
        if i.class.opcode == Op::TypePointer { self.id(i, 1) } else { None }
    }

    /// Value of an OpConstant or of a specialization constant's default.
    fn constant(&self, id: u32) -> u32 {
        self.definition(id).map_or(0, |i| self.literal(i, 0))
    }

    /// From LocalSize, or from the WorkgroupSize constant that overrides it.
    fn local_size(&self) -> [u32; 3] {
        let builtin = self.module.annotations.iter().find(|a| {
            matches!(a.operands.get(1), Some(Operand::Decoration(Decoration::BuiltIn)))
                && matches!(a.operands.get(2), Some(Operand::BuiltIn(BuiltIn::WorkgroupSize)))
        });
        if let Some(composite) =
            builtin.and_then(|a| self.id(a, 0)).and_then(|id| self.definition(id))
        {
            return [0, 1, 2].map(|k| self.id(composite, k).map_or(0, |id| self.constant(id)));
        }
        let modes = self.module.execution_modes.iter();
        let sizes = modes.filter(|m| {
            matches!(m.operands.get(1), Some(Operand::ExecutionMode(ExecutionMode::LocalSize)))
        });
        sizes.map(|m| [2, 3, 4].map(|k| self.literal(m, k))).next().unwrap_or([0; 3])
    }

    /// The literal of `decoration` on `id`, or on member `member` of it.
    fn decoration(&self, id: u32, member: Option<u32>, decoration: Decoration) -> Option<u32> {
        let wanted = Operand::Decoration(decoration);
        self.module.annotations.iter().find_map(|a| {
            let at = match (a.class.opcode, member) {
                (Op::Decorate, None) => 1,
                (Op::MemberDecorate, Some(m)) if self.literal(a, 1) == m => 2,
                _ => return None,
            };
            (self.id(a, 0) == Some(id) && a.operands.get(at) == Some(&wanted))
                .then(|| self.literal(a, at + 1))
        })
    }

    fn name(&self, id: u32, member: Option<u32>) -> String {
        let named = self.module.debug_names.iter().find_map(|n| {
            let text = match (n.class.opcode, member) {
                (Op::Name, None) => n.operands.get(1),
                (Op::MemberName, Some(m)) if self.literal(n, 1) == m => n.operands.get(2),
                _ => None,
            };
            match text {
                Some(Operand::LiteralString(s)) if self.id(n, 0) == Some(id) => Some(s.clone()),
                _ => None,
            }
        });
        named.unwrap_or_default()
    }

    /// Size of a type in bytes; `matrix_stride` and array strides come from decorations.
    fn size(&self, id: u32, matrix_stride: Option<u32>) -> u32 {
        let Some(i) = self.definition(id) else { return 0 };
        match i.class.opcode {
            Op::TypeInt | Op::TypeFloat => self.literal(i, 0) / 8,
            Op::TypeBool => 4,
            Op::TypeVector => self.id(i, 0).map_or(0, |t| self.size(t, None)) * self.literal(i, 1),
            Op::TypeMatrix => {
                let column = self.id(i, 0).map_or(0, |t| self.size(t, None));
                matrix_stride.unwrap_or(column) * self.literal(i, 1)
            }
            Op::TypeArray => {
                let element = self.id(i, 0).map_or(0, |t| self.size(t, None));
                let stride = self.decoration(id, None, Decoration::ArrayStride).unwrap_or(element);
                stride * self.id(i, 1).map_or(0, |n| self.constant(n))
            }
            Op::TypeStruct => self.structure(id).bytes,
            _ => 0,
        }
    }

    fn structure(&self, id: u32) -> Struct {
        let Some(i) = self.definition(id) else { return Struct::default() };
        let mut unplaced = 0;
        let members: Vec<Member> = (0..i.operands.len() as u32)
            .map(|k| {
                let stride = self.decoration(id, Some(k), Decoration::MatrixStride);
                let bytes = self.id(i, k as usize).map_or(0, |t| self.size(t, stride));
                let offset = self.decoration(id, Some(k), Decoration::Offset).unwrap_or(unplaced);
                unplaced = offset + bytes;
                Member { name: self.name(id, Some(k)), offset, bytes }
            })
            .collect();
        let bytes = members.iter().map(|m| m.offset + m.bytes).max().unwrap_or(0);
        Struct { name: self.name(id, None), bytes, members }
    }

    fn binding(&self, id: u32, block: u32) -> Binding {
        let binding = self.decoration(id, None, Decoration::Binding).unwrap_or(0);
        let has = |d| {
            self.decoration(id, None, d).is_some() || self.decoration(block, Some(0), d).is_some()
        };
        let array = self.definition(block).and_then(|b| self.id(b, 0));
        let element = array.and_then(|a| self.definition(a)).and_then(|a| self.id(a, 0));
        let is_struct =
            |id: &u32| self.definition(*id).is_some_and(|i| i.class.opcode == Op::TypeStruct);
        Binding {
            binding,
            kind: BindingKind::Storage,
            name: self.name(block, Some(0)),
            reads: !has(Decoration::NonReadable),
            writes: !has(Decoration::NonWritable),
            stride: array
                .and_then(|a| self.decoration(a, None, Decoration::ArrayStride))
                .unwrap_or(0),
            element: element.filter(is_struct).map(|e| self.structure(e)),
        }
    }

    /// An image of dimension "buffer"; what it samples as tells its texels.
    fn texels(&self, id: u32, image: u32) -> Binding {
        let sampled =
            self.definition(image).and_then(|i| self.id(i, 0)).and_then(|t| self.definition(t));
        let of_floats = sampled.is_some_and(|t| t.class.opcode == Op::TypeFloat);
        let kind = if of_floats { BindingKind::Floats } else { BindingKind::Texels };
        Binding {
            binding: self.decoration(id, None, Decoration::Binding).unwrap_or(0),
            kind,
            name: self.name(id, None),
            reads: true,
            writes: false,
            stride: kind.texel_bytes(),
            element: None,
        }
    }
}
