//! Reflection of a SPIR-V module: workgroup size, push constants, and its buffers with their
//! accesses.

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{BuiltIn, Decoration, ExecutionMode, Op, StorageClass};

use crate::error::{Error, Result};

/// The interface of a shader.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reflection {
    /// Invocations of a workgroup along x, y, z; 0 in a graphics shader.
    pub local_size: [u32; 3],
    /// The push constants, where there are any.
    pub push: Option<Struct>,
    /// The bindings of set 0, the only one that nimbus uses, in ascending order.
    pub bindings: Vec<Binding>,
    /// Bytes of memory that a workgroup shares.
    pub shared_bytes: u32,
}

/// A struct; names are empty where the compiler stripped them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Struct {
    /// Its name.
    pub name: String,
    /// Its size in bytes, without padding at the end.
    pub bytes: u32,
    /// Its members in order.
    pub members: Vec<Member>,
}

/// A member of a struct.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// Bytes from the struct's beginning.
    pub offset: u32,
    /// Its size in bytes.
    pub bytes: u32,
}

/// How a shader declares a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BindingKind {
    /// `buffer`: reads and writes records.
    Storage,
    /// `usamplerBuffer`: reads four words at a time.
    Texels,
    /// `uimageBuffer`: writes four words at a time, and may read them.
    TexelStores,
    /// `samplerBuffer`: reads single floats.
    Floats,
}

impl BindingKind {
    /// Returns the bytes of a texel; 0 for records, whose block declares them.
    pub fn texel_bytes(self) -> u32 {
        match self {
            BindingKind::Storage => 0,
            BindingKind::Texels | BindingKind::TexelStores => 16,
            BindingKind::Floats => 4,
        }
    }
}

/// A buffer of a shader.
#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    /// Its binding number.
    pub binding: u32,
    /// Its declaration.
    pub kind: BindingKind,
    /// Its name.
    pub name: String,
    /// Whether the shader may read it.
    pub reads: bool,
    /// Whether the shader may write it.
    pub writes: bool,
    /// Bytes from one element of the block's runtime array to the next.
    pub stride: u32,
    /// The element, where it is a struct.
    pub element: Option<Struct>,
}

/// Reflects a module of one entry point.
///
/// # Errors
/// `words` are no SPIR-V.
pub fn reflect(name: &str, words: &[u32]) -> Result<Reflection> {
    let module = rspirv::dr::load_words(words)
        .map_err(|e| Error::Shader { name: name.to_owned(), what: format!("SPIR-V: {e}") })?;
    let m = Reader(&module);
    let mut found = Reflection { local_size: m.local_size(), ..Reflection::default() };
    for variable in module.types_global_values.iter().filter(|i| i.class.opcode == Op::Variable) {
        let (Some(id), Some(Operand::StorageClass(class))) =
            (variable.result_id, variable.operands.first())
        else {
            continue;
        };
        let pointer = variable.result_type.and_then(|t| m.definition(t));
        let Some(pointee) = pointer.and_then(|pointer| id_of(pointer, 1)) else { continue };
        match class {
            StorageClass::PushConstant => found.push = Some(m.structure(pointee)),
            StorageClass::StorageBuffer => found.bindings.push(m.buffer(id, pointee)),
            StorageClass::UniformConstant => found.bindings.push(m.texels(id, pointee)),
            StorageClass::Workgroup => found.shared_bytes += m.size(pointee, None),
            _ => {}
        }
    }
    found.bindings.sort_by_key(|b| b.binding);
    Ok(found)
}

fn id_of(i: &Instruction, operand: usize) -> Option<u32> {
    i.operands.get(operand)?.id_ref_any()
}

fn literal(operand: Option<&Operand>) -> u32 {
    match operand {
        Some(Operand::LiteralBit32(value)) => *value,
        _ => 0,
    }
}

/// Returns what instructions say of `id`, or of a member of it: their operands after that.
fn payloads(
    instructions: &[Instruction],
    [plain, of_member]: [Op; 2],
    id: u32,
    member: Option<u32>,
) -> impl Iterator<Item = &[Operand]> {
    instructions.iter().filter_map(move |i| {
        let of_id = id_of(i, 0) == Some(id);
        match member {
            None if of_id && i.class.opcode == plain => i.operands.get(1..),
            Some(m) if of_id && i.class.opcode == of_member => {
                (literal(i.operands.get(1)) == m).then(|| i.operands.get(2..))?
            }
            _ => None,
        }
    })
}

struct Reader<'a>(&'a Module);

impl Reader<'_> {
    fn definition(&self, id: u32) -> Option<&Instruction> {
        self.0.types_global_values.iter().find(|i| i.result_id == Some(id))
    }

    /// Returns the definition of the type that operand `operand` of `id`'s definition names.
    fn operand_of(&self, id: u32, operand: usize) -> Option<&Instruction> {
        self.definition(id_of(self.definition(id)?, operand)?)
    }

    /// Returns the value of a constant, or the default of a specialization constant.
    fn constant(&self, id: u32) -> u32 {
        self.definition(id).map_or(0, |i| literal(i.operands.first()))
    }

    /// Returns the size from the WorkgroupSize constant, or else from LocalSize.
    fn local_size(&self) -> [u32; 3] {
        let is_size = |a: &&Instruction| {
            a.operands.get(1..3)
                == Some(&[
                    Operand::Decoration(Decoration::BuiltIn),
                    Operand::BuiltIn(BuiltIn::WorkgroupSize),
                ])
        };
        let builtin = self.0.annotations.iter().find(is_size);
        if let Some(size) = builtin.and_then(|a| self.definition(id_of(a, 0)?)) {
            return [0, 1, 2].map(|k| id_of(size, k).map_or(0, |id| self.constant(id)));
        }
        let is_local = Some(&Operand::ExecutionMode(ExecutionMode::LocalSize));
        let mode = self.0.execution_modes.iter().find(|mode| mode.operands.get(1) == is_local);
        [2, 3, 4].map(|k| literal(mode.and_then(|mode| mode.operands.get(k))))
    }

    /// Returns the literal of a decoration of `id`, or of a member of it.
    fn decoration(&self, id: u32, member: Option<u32>, wanted: Decoration) -> Option<u32> {
        payloads(&self.0.annotations, [Op::Decorate, Op::MemberDecorate], id, member)
            .find(|payload| payload.first() == Some(&Operand::Decoration(wanted)))
            .map(|payload| literal(payload.get(1)))
    }

    fn name(&self, id: u32, member: Option<u32>) -> String {
        let mut names = payloads(&self.0.debug_names, [Op::Name, Op::MemberName], id, member);
        match names.next().and_then(<[_]>::first) {
            Some(Operand::LiteralString(name)) => name.clone(),
            _ => String::new(),
        }
    }

    /// Returns the size of a type in bytes; `matrix_stride` comes from the member's decoration.
    fn size(&self, id: u32, matrix_stride: Option<u32>) -> u32 {
        let Some(i) = self.definition(id) else { return 0 };
        let element = || id_of(i, 0).map_or(0, |t| self.size(t, None));
        let count = || literal(i.operands.get(1));
        match i.class.opcode {
            Op::TypeInt | Op::TypeFloat => literal(i.operands.first()) / 8,
            Op::TypeBool => 4,
            Op::TypeVector => element() * count(),
            Op::TypeMatrix => matrix_stride.unwrap_or_else(element) * count(),
            Op::TypeArray => {
                let stride = self.decoration(id, None, Decoration::ArrayStride);
                stride.unwrap_or_else(element) * id_of(i, 1).map_or(0, |n| self.constant(n))
            }
            Op::TypeStruct => self.structure(id).bytes,
            _ => 0,
        }
    }

    fn structure(&self, id: u32) -> Struct {
        let Some(i) = self.definition(id) else { return Struct::default() };
        let mut end = 0;
        let member = |k: u32| {
            let stride = self.decoration(id, Some(k), Decoration::MatrixStride);
            let bytes = id_of(i, k as usize).map_or(0, |t| self.size(t, stride));
            // Members of shared memory have no offsets.
            let offset = self.decoration(id, Some(k), Decoration::Offset).unwrap_or(end);
            end = offset + bytes;
            Member { name: self.name(id, Some(k)), offset, bytes }
        };
        let members: Vec<Member> = (0..i.operands.len() as u32).map(member).collect();
        let bytes = members.iter().map(|m| m.offset + m.bytes).max().unwrap_or(0);
        Struct { name: self.name(id, None), bytes, members }
    }

    fn binding(&self, id: u32) -> u32 {
        self.decoration(id, None, Decoration::Binding).unwrap_or(0)
    }

    /// Reflects a storage buffer, whose block ends in a runtime array.
    fn buffer(&self, id: u32, block: u32) -> Binding {
        let has = |d| {
            self.decoration(id, None, d).or_else(|| self.decoration(block, Some(0), d)).is_some()
        };
        let array = self.operand_of(block, 0).and_then(|array| array.result_id);
        let stride = array.and_then(|a| self.decoration(a, None, Decoration::ArrayStride));
        let element = array.and_then(|a| self.operand_of(a, 0));
        let element = element.filter(|e| e.class.opcode == Op::TypeStruct);
        Binding {
            binding: self.binding(id),
            kind: BindingKind::Storage,
            name: self.name(block, Some(0)),
            reads: !has(Decoration::NonReadable),
            writes: !has(Decoration::NonWritable),
            stride: stride.unwrap_or(0),
            element: element.and_then(|e| e.result_id).map(|e| self.structure(e)),
        }
    }

    /// Reflects a texel buffer: an image of dimension "buffer". The sampled type tells its texels,
    /// and the operand after the dimension's three whether they are stored.
    fn texels(&self, id: u32, image: u32) -> Binding {
        /// "Sampled" of an image that shaders store to.
        const STORED: u32 = 2;
        let sampled = self.operand_of(image, 0);
        let is_float = sampled.is_some_and(|t| t.class.opcode == Op::TypeFloat);
        let is_stored =
            self.definition(image).is_some_and(|i| literal(i.operands.get(5)) == STORED);
        let kind = match (is_stored, is_float) {
            (true, _) => BindingKind::TexelStores,
            (false, true) => BindingKind::Floats,
            (false, false) => BindingKind::Texels,
        };
        Binding {
            binding: self.binding(id),
            kind,
            name: self.name(id, None),
            reads: self.decoration(id, None, Decoration::NonReadable).is_none(),
            writes: is_stored,
            stride: kind.texel_bytes(),
            element: None,
        }
    }
}
