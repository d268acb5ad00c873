// SPDX-License-Identifier: Apache-2.0
#include <hdf5.h>

#include <algorithm>
#include <stdexcept>

#include "recording/matrices.h"

namespace tandem::recording {
namespace {

constexpr hsize_t kChunkRows = 4096;
constexpr unsigned kDeflate = 3;

/** RAII handle of an HDF5 object, released by `close`. */
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
    if (id < 0)
      throw std::runtime_error(what + ": cannot be written as HDF5");
  }
  ~Handle() { close_(id_); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

void check(herr_t result, const std::string& what) {
  if (result < 0)
    throw std::runtime_error(what + ": cannot be written as HDF5");
}

void setText(hid_t object, const std::string& name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, name), space(H5Screate(H5S_SCALAR), H5Sclose, name);
  check(H5Tset_size(type, H5T_VARIABLE), name);
  check(H5Tset_cset(type, H5T_CSET_UTF8), name);
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose, name);
  const char* text = value.c_str();
  check(H5Awrite(attribute, type, &text), name);
}

void writeSet(hid_t group, const NamedMatrix& member, hid_t type, hsize_t rows, hsize_t columns, const void* data) {
  const hsize_t size[2] = {rows, columns};
  const int dimensions = columns == 1 ? 1 : 2;
  const Handle space(H5Screate_simple(dimensions, size, nullptr), H5Sclose, member.name);
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, member.name);
  if (rows > 0) {
    const hsize_t chunk[2] = {std::min(rows, kChunkRows), columns};
    check(H5Pset_chunk(properties, dimensions, chunk), member.name);
    check(H5Pset_deflate(properties, kDeflate), member.name);
  }
  const Handle set(H5Dcreate2(group, member.name.c_str(), type, space, H5P_DEFAULT, properties, H5P_DEFAULT), H5Dclose,
                   member.name);
  if (rows > 0)
    check(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), member.name);
  setText(set, "member", member.original);
}

template <class T>
void write(hid_t group, const NamedMatrix& member, const Matrix<T>& matrix) {
  const hid_t type = std::is_same_v<T, double>         ? H5T_NATIVE_DOUBLE
                     : std::is_same_v<T, std::int64_t> ? H5T_NATIVE_INT64
                                                       : H5T_NATIVE_UINT64;
  writeSet(group, member, type, matrix.rows, matrix.columns, matrix.values.data());
}

void write(hid_t group, const NamedMatrix& member, const Matrix<std::string>& matrix) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, member.name);
  check(H5Tset_size(type, H5T_VARIABLE), member.name);
  check(H5Tset_cset(type, H5T_CSET_UTF8), member.name);
  std::vector<const char*> texts;
  for (const std::string& text : matrix.values)
    texts.push_back(text.c_str());
  writeSet(group, member, type, matrix.rows, matrix.columns, texts.data());
}

}  // namespace

void exportHdf5(const ExportSet& set, const std::filesystem::path& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are reported by exceptions, not on stderr
  const Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose, path.string());
  for (const auto& [key, value] : set.about)
    setText(file, key, value);
  for (const NamedMatrices& matrices : matricesOf(set)) {
    const Handle group(H5Gcreate2(file, matrices.name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose,
                       path.string() + ": " + matrices.name);
    setText(group, "topic", matrices.original);
    for (const NamedMatrix& member : matrices.members)
      std::visit([&](const auto& matrix) { write(group, member, matrix); }, member.matrix);
  }
  check(H5Fflush(file, H5F_SCOPE_GLOBAL), path.string());
}

}  // namespace tandem::recording
