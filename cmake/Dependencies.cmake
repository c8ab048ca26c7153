# Every third-party package of the project, in one place. All are Debian 12 packages (deploy/packages.txt).
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(absl REQUIRED)
find_package(TBB REQUIRED)
find_package(Protobuf REQUIRED)
find_package(gRPC CONFIG REQUIRED)
find_package(CLI11 2.1 REQUIRED)
<<<<<<< HEAD
find_package(embree 3.13 REQUIRED)
=======
find_package(SQLite3 3.40 REQUIRED)
find_package(spdlog 1.10 REQUIRED)
>>>>>>> 7a73d2a (Catalogue of jobs in SQLite, executor of worker processes, task of a worker)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc imgcodecs)

find_program(WEFT_CCACHE ccache)
if(WEFT_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${WEFT_CCACHE})
endif()
