# Flags that every Weft target shares, and the two functions that declare libraries and tests.

add_library(weft_flags INTERFACE)
target_compile_options(weft_flags INTERFACE
  -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wno-missing-field-initializers
  # Fused multiply-add would make the same inputs give other bytes on another processor.
  -ffp-contract=off)
if(WEFT_WARNINGS_AS_ERRORS)
  target_compile_options(weft_flags INTERFACE -Werror)
endif()
if(WEFT_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # The private part of a class has fields of types of its own file; GCC warns of them in every file that is included.
  target_compile_options(weft_flags INTERFACE -Wno-subobject-linkage)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  # What a mutex guards is used under it alone, as base/mutex.h says.
  target_compile_options(weft_flags INTERFACE -Wthread-safety -Werror=thread-safety)
endif()
if(WEFT_SANITIZE)
  add_compile_options(-fsanitize=${WEFT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${WEFT_SANITIZE})
endif()
if(WEFT_LIBFUZZER)
  add_compile_options(-fsanitize=fuzzer-no-link)
  add_link_options(-fsanitize=fuzzer-no-link)
endif()
target_include_directories(weft_flags INTERFACE ${PROJECT_SOURCE_DIR})

# weft_library(NAME SOURCES a.cpp ... PUBLIC deps ... PRIVATE deps ...)
function(weft_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_link_libraries(${name} PUBLIC weft_flags ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
endfunction()

# The executables of the tests with the labels unit and fuzz.
add_custom_target(fast_tests)

# weft_test(NAME SOURCES a.cpp ... LINK deps ... [LABEL unit|system|fuzz] [WHOLE Suite ...])
# A case is a test of ctest in a process of its own. Those of a suite under WHOLE are one, for what they begin with takes long.
function(weft_test name)
  cmake_parse_arguments(arg "" "LABEL;TIMEOUT" "SOURCES;LINK;WHOLE" ${ARGN})
  if(NOT arg_LABEL)
    set(arg_LABEL unit)
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()
  if(WEFT_SANITIZE)
    math(EXPR arg_TIMEOUT "10 * ${arg_TIMEOUT}")
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE weft_flags ${arg_LINK} GTest::gtest GTest::gmock GTest::gtest_main)
  # Little of a test's time is spent in its own code, and most of its compiler's time in optimising its expectations.
  target_compile_options(${name} PRIVATE -O1)
  if(NOT arg_LABEL STREQUAL "system")
    add_dependencies(fast_tests ${name})
  endif()
  set(others "*")
  foreach(suite ${arg_WHOLE})
    string(REGEX REPLACE "^([*]-?)" "*-${suite}.*:" others "${others}")
    add_test(NAME ${suite} COMMAND ${name} --gtest_filter=${suite}.*)
    set_tests_properties(${suite} PROPERTIES LABELS ${arg_LABEL} TIMEOUT ${arg_TIMEOUT} FAIL_REGULAR_EXPRESSION "Running 0 tests")
  endforeach()
  gtest_discover_tests(${name}
    TEST_FILTER "${others}"
    PROPERTIES LABELS ${arg_LABEL} TIMEOUT ${arg_TIMEOUT}
    DISCOVERY_TIMEOUT 60)
endfunction()
