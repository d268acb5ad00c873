// SPDX-License-Identifier: Apache-2.0
#include <matio.h>

#include <memory>
#include <stdexcept>

#include "recording/matrices.h"

namespace tandem::recording {
namespace {

constexpr std::size_t kLongestName = 63;  // MATLAB's namelengthmax

struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

Variable checked(matvar_t* variable) {
  if (variable == nullptr)
    throw std::runtime_error("a variable of a MATLAB file cannot be made: out of memory?");
  return Variable(variable);
}

/// Keeps the end of a long name, which distinguishes it from others; the result begins with a letter.
std::string shortName(const std::string& name) {
  std::string text = name.size() <= kLongestName ? name : name.substr(name.size() - kLongestName);
  if (text.empty() || !((text[0] >= 'a' && text[0] <= 'z') || (text[0] >= 'A' && text[0] <= 'Z')))
    text = "x" + text.substr(text.size() == kLongestName ? 1 : 0);
  return text;
}

/// MATLAB stores matrices by columns.
template <class T>
Variable numbers(const Matrix<T>& matrix, matio_classes type_class, matio_types type) {
  std::vector<T> turned(matrix.values.size());
  for (std::size_t row = 0; row < matrix.rows; ++row) {
    for (std::size_t i = 0; i < matrix.columns; ++i)
      turned[i * matrix.rows + row] = matrix.values[row * matrix.columns + i];
  }
  std::size_t size[2] = {matrix.rows, matrix.columns};
  return checked(Mat_VarCreate(nullptr, type_class, type, 2, size, turned.data(), 0));
}

Variable toVariable(const Matrix<double>& matrix) { return numbers(matrix, MAT_C_DOUBLE, MAT_T_DOUBLE); }
Variable toVariable(const Matrix<std::int64_t>& matrix) { return numbers(matrix, MAT_C_INT64, MAT_T_INT64); }
Variable toVariable(const Matrix<std::uint64_t>& matrix) { return numbers(matrix, MAT_C_UINT64, MAT_T_UINT64); }

Variable toVariable(const std::string& text) {
  std::size_t size[2] = {text.empty() ? std::size_t{0} : std::size_t{1}, text.size()};
  return checked(Mat_VarCreate(nullptr, MAT_C_CHAR, MAT_T_UINT8, 2, size, const_cast<char*>(text.data()), 0));
}

Variable toVariable(const Matrix<std::string>& matrix) {
  std::size_t size[2] = {matrix.rows, matrix.columns};
  Variable cells = checked(Mat_VarCreate(nullptr, MAT_C_CELL, MAT_T_CELL, 2, size, nullptr, 0));
  for (std::size_t row = 0; row < matrix.rows; ++row) {
    for (std::size_t i = 0; i < matrix.columns; ++i)
      Mat_VarSetCell(cells.get(), static_cast<int>(i * matrix.rows + row),
                     toVariable(matrix.values[row * matrix.columns + i]).release());
  }
  return cells;
}

Variable toStruct(const std::string& name, std::vector<std::pair<std::string, Variable>>&& members) {
  std::vector<const char*> names;
  for (const auto& [member, variable] : members)
    names.push_back(member.c_str());
  std::size_t size[2] = {1, 1};
  Variable all = checked(Mat_VarCreateStruct(name.c_str(), 2, size, names.data(), static_cast<unsigned>(names.size())));
  for (auto& [member, variable] : members)
    Mat_VarSetStructFieldByName(all.get(), member.c_str(), 0, variable.release());
  return all;
}

}  // namespace

void exportMat(const ExportSet& set, const std::filesystem::path& file) {
  std::unique_ptr<mat_t, int (*)(mat_t*)> mat(Mat_CreateVer(file.c_str(), nullptr, MAT_FT_MAT5), Mat_Close);
  const auto write = [&](const Variable& variable) {
    if (!mat || Mat_VarWrite(mat.get(), variable.get(), MAT_COMPRESSION_ZLIB) != 0)
      throw std::runtime_error(file.string() + ": cannot be written");
  };
  if (!mat)
    throw std::runtime_error(file.string() + ": cannot be created");
  for (const NamedMatrices& group : matricesOf(set)) {
    std::vector<std::pair<std::string, Variable>> members;
    for (const NamedMatrix& member : group.members)
      members.emplace_back(shortName(member.name),
                           std::visit([](const auto& matrix) { return toVariable(matrix); }, member.matrix));
    write(toStruct(shortName(group.name), std::move(members)));
  }
  std::vector<std::pair<std::string, Variable>> about;
  for (const auto& [key, value] : set.about)
    about.emplace_back(shortName(plainName(key)), toVariable(value));
  if (!about.empty())
    write(toStruct("about", std::move(about)));
}

}  // namespace tandem::recording
