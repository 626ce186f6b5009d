# Settings of the build of shaderc, which CMake reads before its project (.cargo/config.toml). They
# hold for one version of the sources: another one is built whole, as without this file.
if(NOT CMAKE_SOURCE_DIR MATCHES "/shaderc-sys-0\\.10\\.1/" OR CMAKE_VERSION VERSION_LESS 3.19)
  return()
endif()
set(SHADERC_SKIP_EXAMPLES ON CACHE BOOL "")
set(SKIP_SPIRV_TOOLS_INSTALL ON CACHE BOOL "")
set(CMAKE_PROJECT_spirv-tools_INCLUDE "${CMAKE_CURRENT_LIST_DIR}/targets.cmake" CACHE FILEPATH "")
