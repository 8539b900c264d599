# The library as an IMPORTED target. Copy this file into your project, or include it from here:
#
#   set(DELTA_CAL_RUST_TARGET thumbv7em-none-eabihf)      # hard float; thumbv7em-none-eabi: soft and softfp
#   set(DELTA_CAL_RUST_CPU cortex-m7)                     # if wanted: whatever that processor has, double precision too
#   set(DELTA_CAL_PROFILE small)                          # if wanted: half the flash, more instructions
#   include(path/to/delta-cal/bindings/c/cmake/delta_cal.cmake)
#   target_link_libraries(your_firmware PRIVATE delta_cal::delta_cal)
#
# Needs Rust (https://rustup.rs). If the copy does not lie in the repository, set DELTA_CAL_SOURCE to the repository.

if(NOT DEFINED DELTA_CAL_SOURCE)
  set(DELTA_CAL_SOURCE "${CMAKE_CURRENT_LIST_DIR}/../../..")
endif()
# cargo would build everything again under another name of the same folder.
get_filename_component(DELTA_CAL_SOURCE "${DELTA_CAL_SOURCE}" REALPATH)
if(NOT DEFINED DELTA_CAL_RUST_TARGET)
  set(DELTA_CAL_RUST_TARGET "") # this machine
endif()
if(NOT DEFINED DELTA_CAL_BUILD)
  set(DELTA_CAL_BUILD "${CMAKE_CURRENT_BINARY_DIR}/delta_cal")
endif()
find_program(DELTA_CAL_CARGO cargo HINTS "$ENV{HOME}/.cargo/bin" REQUIRED)

if(DELTA_CAL_RUST_CPU)
  set(DELTA_CAL_BUILD "${DELTA_CAL_BUILD}/${DELTA_CAL_RUST_CPU}")
endif()
if(NOT DELTA_CAL_PROFILE AND DELTA_CAL_RUST_TARGET)
  set(DELTA_CAL_PROFILE firmware)
elseif(NOT DELTA_CAL_PROFILE)
  set(DELTA_CAL_PROFILE release)
endif()
set(delta_cal_arguments --lib --package delta-cal-c --profile ${DELTA_CAL_PROFILE})
# cargo's name of the folder.
string(REGEX REPLACE "^dev$" debug delta_cal_profile "${DELTA_CAL_PROFILE}")
if(DELTA_CAL_RUST_TARGET)
  # An image of C holds no other Rust: it needs the panic handler, which nothing calls.
  list(APPEND delta_cal_arguments --target "${DELTA_CAL_RUST_TARGET}" --features panic-handler)
  set(delta_cal_folder "${DELTA_CAL_BUILD}/${DELTA_CAL_RUST_TARGET}/${delta_cal_profile}")
  set(delta_cal_kinds staticlib)
else()
  # Compiled once for both.
  set(delta_cal_kinds staticlib,cdylib)
  set(delta_cal_folder "${DELTA_CAL_BUILD}/${delta_cal_profile}")
endif()
if(DELTA_CAL_RUST_CPU)
  list(APPEND delta_cal_arguments
    --config "target.${DELTA_CAL_RUST_TARGET}.rustflags=['-Ctarget-cpu=${DELTA_CAL_RUST_CPU}']")
endif()
set(DELTA_CAL_ARCHIVE "${delta_cal_folder}/libdelta_cal_c.a")

# cargo itself knows whether there is anything to do.
add_custom_target(delta_cal_archive
  COMMAND "${DELTA_CAL_CARGO}" rustc --quiet ${delta_cal_arguments} --crate-type ${delta_cal_kinds}
          --target-dir "${DELTA_CAL_BUILD}"
  WORKING_DIRECTORY "${DELTA_CAL_SOURCE}"
  BYPRODUCTS "${DELTA_CAL_ARCHIVE}"
  VERBATIM)

add_library(delta_cal::delta_cal STATIC IMPORTED GLOBAL)
set_target_properties(delta_cal::delta_cal PROPERTIES
  IMPORTED_LOCATION "${DELTA_CAL_ARCHIVE}"
  INTERFACE_INCLUDE_DIRECTORIES "${DELTA_CAL_SOURCE}/bindings/c/include")
if(NOT DELTA_CAL_RUST_TARGET AND UNIX)
  set_target_properties(delta_cal::delta_cal PROPERTIES INTERFACE_LINK_LIBRARIES "m")
endif()
add_dependencies(delta_cal::delta_cal delta_cal_archive)
