# Changes the targets of shaderc's projects when CMake has configured all of them. Parsing headers
# takes three quarters of a file's compilation, and the files of a unit share that.

# Compiles files of `target` alone, since they define names that other files define too.
function(compile_alone target)
  get_target_property(folder ${target} SOURCE_DIR)
  list(TRANSFORM ARGN PREPEND "${folder}/")
  set_source_files_properties(
    ${ARGN} TARGET_DIRECTORY ${target} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

function(change_targets)
  # shaderc links none of these.
  foreach(tool shared reduce lint link diff)
    if(TARGET SPIRV-Tools-${tool})
      set_target_properties(SPIRV-Tools-${tool} PROPERTIES EXCLUDE_FROM_ALL ON)
    endif()
  endforeach()
  # A unit has 14 files, so that several units remain for several cores. The files named below
  # compile alone.
  set_target_properties(
    SPIRV-Tools-opt SPIRV-Tools-static glslang
    PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 14)
  compile_alone(
    SPIRV-Tools-opt
    aggressive_dead_code_elim_pass.cpp
    canonicalize_ids_pass.cpp
    convert_to_sampled_image_pass.cpp
    copy_prop_arrays.cpp
    desc_sroa_util.cpp
    eliminate_dead_io_components_pass.cpp
    folding_rules.cpp
    inline_opaque_pass.cpp
    invocation_interlock_placement_pass.cpp
    local_access_chain_convert_pass.cpp
    local_single_block_elim_pass.cpp
    local_single_store_elim_pass.cpp
    mem_pass.cpp
    reduce_load_size.cpp
    spread_volatile_semantics.cpp
    vector_dce.cpp)
  compile_alone(
    SPIRV-Tools-static spirv_reducer_options.cpp val/validate_ray_tracing_reorder.cpp)
  compile_alone(
    glslang
    HLSL/hlslScanContext.cpp
    ../SPIRV/CInterface/spirv_c_interface.cpp
    ../SPIRV/SpvBuilder.cpp)
endfunction()

cmake_language(DEFER DIRECTORY "${CMAKE_SOURCE_DIR}" CALL change_targets)
