# The scene file loader (docs/scene_format.md).
find_package(yaml-cpp REQUIRED)
target_sources(vest_tissue PRIVATE
  ${CMAKE_CURRENT_LIST_DIR}/csv_reader.cpp
  ${CMAKE_CURRENT_LIST_DIR}/loader.cpp
  ${CMAKE_CURRENT_LIST_DIR}/loader_baked.cpp
  ${CMAKE_CURRENT_LIST_DIR}/loader_check.cpp
  ${CMAKE_CURRENT_LIST_DIR}/loader_fem.cpp
  ${CMAKE_CURRENT_LIST_DIR}/loader_living.cpp
  ${CMAKE_CURRENT_LIST_DIR}/loader_rods.cpp
  ${CMAKE_CURRENT_LIST_DIR}/loader_sutures.cpp
  ${CMAKE_CURRENT_LIST_DIR}/scene_files.cpp
  ${CMAKE_CURRENT_LIST_DIR}/yaml_reader.cpp)
target_link_libraries(vest_tissue PRIVATE yaml-cpp)
