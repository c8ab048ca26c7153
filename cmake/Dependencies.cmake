# Every third-party package of the project, in one place. All are Debian 12 packages (deploy/packages.txt).
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(absl REQUIRED)
find_package(TBB REQUIRED)
find_package(Protobuf REQUIRED)
find_package(gRPC CONFIG REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(embree 3.13 REQUIRED)
find_package(SQLite3 3.40 REQUIRED)
find_package(spdlog 1.10 REQUIRED)
find_package(OpenSSL 3 REQUIRED COMPONENTS Crypto SSL) # SHA-256, TLS of the console
find_package(CURL 7.88 REQUIRED)
find_package(TinyGLTF REQUIRED)
find_package(ZLIB REQUIRED)
find_package(meshoptimizer REQUIRED) # decimation of the view in reports
find_package(JPEG REQUIRED)
find_package(PNG 1.6 REQUIRED)
find_package(TIFF 4.5 REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(aravis REQUIRED IMPORTED_TARGET aravis-0.8>=0.8.26)
pkg_check_modules(glib REQUIRED IMPORTED_TARGET glib-2.0>=2.74) # Unicode's forms of names
pkg_check_modules(cairo REQUIRED IMPORTED_TARGET cairo>=1.16 cairo-pdf cairo-svg)
pkg_check_modules(apriltag REQUIRED IMPORTED_TARGET apriltag>=3.3)
pkg_check_modules(seccomp REQUIRED IMPORTED_TARGET libseccomp>=2.5)
pkg_check_modules(zstd REQUIRED IMPORTED_TARGET libzstd>=1.5)
pkg_check_modules(prometheus REQUIRED IMPORTED_TARGET prometheus-cpp-core>=1.0)
pkg_check_modules(ltc REQUIRED IMPORTED_TARGET ltc>=1.3) # linear timecode
pkg_check_modules(archive REQUIRED IMPORTED_TARGET libarchive>=3.6) # support bundles
pkg_check_modules(systemd REQUIRED IMPORTED_TARGET libsystemd>=252) # sd_notify
pkg_check_modules(yaml REQUIRED IMPORTED_TARGET yaml-cpp>=0.7) # rigs of other programs
pkg_check_modules(xxhash REQUIRED IMPORTED_TARGET libxxhash>=0.8)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core calib3d dnn imgproc imgcodecs video) # imgcodecs: in tests only
find_package(Ceres 2.1 REQUIRED)

# Header-only here. Without it meshes in OBJ are refused, and PLY works.
find_path(WEFT_TINY_OBJ tiny_obj_loader.h)

# 260 packages more; without it PCD is refused, and PLY works.
set(WEFT_WITH_PCL AUTO CACHE STRING "Build weft-pcl, which reads and writes PCD: AUTO (where PCL is found), ON or OFF")
set_property(CACHE WEFT_WITH_PCL PROPERTY STRINGS AUTO ON OFF)
if(WEFT_WITH_PCL STREQUAL "AUTO")
  pkg_check_modules(pcl QUIET IMPORTED_TARGET pcl_io>=1.13 pcl_filters)
elseif(WEFT_WITH_PCL)
  pkg_check_modules(pcl REQUIRED IMPORTED_TARGET pcl_io>=1.13 pcl_filters)
else()
  set(pcl_FOUND FALSE)
endif()

# For weft-train alone: 1.5 GB of packages. Nets run without it.
set(WEFT_TRAIN AUTO CACHE STRING "Build weft-train, which trains nets of avatars: AUTO (where libtorch and ONNX are found), ON or OFF")
set_property(CACHE WEFT_TRAIN PROPERTY STRINGS AUTO ON OFF)
if(WEFT_TRAIN)
  find_path(WEFT_ONNX_HEADERS onnx/onnx_pb.h)
  find_library(WEFT_ONNX_PROTO onnx_proto)
  if(WEFT_TRAIN STREQUAL "AUTO")
    find_package(Torch QUIET)
  else()
    find_package(Torch REQUIRED)
    if(NOT WEFT_ONNX_HEADERS OR NOT WEFT_ONNX_PROTO)
      message(FATAL_ERROR "WEFT_TRAIN is ON, and ONNX is missing: install libonnx-dev")
    endif()
  endif()
endif()

find_program(WEFT_CCACHE ccache)
if(WEFT_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${WEFT_CCACHE})
endif()
