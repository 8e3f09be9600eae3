# SPDX-License-Identifier: Apache-2.0
# loxo_room(NAME ROOMS … DOORS …): the static library loxo_NAME from loxo/NAME/*.cpp and its tests from
# loxo/NAME/*_test.cpp. Its include path holds its own folder and those of the rooms it names, nothing else:
# an #include against the one-way rule does not compile.
if(LOXO_TESTS)
  find_package(GTest REQUIRED)
  include(GoogleTest)
endif()

function(loxo_room name)
  cmake_parse_arguments(arg "" "" "ROOMS;DOORS" ${ARGN})
  set(dir ${CMAKE_CURRENT_SOURCE_DIR}/loxo/${name})
  set(view ${CMAKE_CURRENT_BINARY_DIR}/rooms/${name})
  file(MAKE_DIRECTORY ${view}/loxo)
  if(NOT EXISTS ${view}/loxo/${name})
    file(CREATE_LINK ${dir} ${view}/loxo/${name} SYMBOLIC)
  endif()

  file(GLOB sources CONFIGURE_DEPENDS ${dir}/*.cpp)
  file(GLOB tests CONFIGURE_DEPENDS ${dir}/*_test.cpp)
  if(tests)
    list(REMOVE_ITEM sources ${tests})
  endif()
  if(sources)
    add_library(loxo_${name} STATIC ${sources})
    set(scope PUBLIC)
  else()
    add_library(loxo_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(loxo_${name} ${scope} ${view})
  foreach(room IN LISTS arg_ROOMS)
    target_link_libraries(loxo_${name} ${scope} loxo_${room})
  endforeach()
  foreach(door IN LISTS arg_DOORS)
    target_link_libraries(loxo_${name} ${scope} door::${door})
  endforeach()

  if(LOXO_TESTS AND tests)
    add_executable(${name}_tests ${tests})
    loxo_test_places(${name}_tests "" "")
    target_link_libraries(${name}_tests PRIVATE loxo_${name} door::geographiclib GTest::gtest_main)
    target_include_directories(${name}_tests PRIVATE ${PROJECT_SOURCE_DIR}/tests)
    gtest_discover_tests(${name}_tests TEST_PREFIX ${name}. DISCOVERY_MODE PRE_TEST)
  endif()
endfunction()

# tests/places.cpp for one test program: the only file whose compile command names this checkout.
function(loxo_test_places target program embed)
  set(places ${CMAKE_CURRENT_BINARY_DIR}/${target}_places.cpp)
  file(CONFIGURE OUTPUT ${places} CONTENT
"#define LOXO_PLACE_SOURCE \"${PROJECT_SOURCE_DIR}\"
#define LOXO_PLACE_PROGRAM \"${program}\"
#define LOXO_PLACE_EMBED \"${embed}\"
#include \"places.cpp\"
" @ONLY)
  target_sources(${target} PRIVATE ${places})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
endfunction()
