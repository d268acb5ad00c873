// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include "python/bindings/bind.h"
#include "python/bindings/rows.h"
#include "recording/reader.h"
#include "recording/table.h"

namespace tandem::python {
namespace {

/// Values of a column: a vector of scalars, a matrix for arrays (short rows are padded with zeros), a list of texts.
template <class T>
py::object values(const recording::Column& column, const std::vector<T>& all, std::size_t rows) {
  if (!column.is_array && column.width == 1 && all.size() == rows)
    return py::array_t<T>(static_cast<py::ssize_t>(rows), all.data());
  py::array_t<T> matrix({rows, column.width});
  std::fill_n(matrix.mutable_data(), rows * column.width, T{});
  for (std::size_t row = 0; row < rows; ++row)
    std::copy_n(all.data() + column.begin(row), column.size(row), matrix.mutable_data() + row * column.width);
  return matrix;
}

py::object valuesOf(const recording::Column& column, std::size_t rows) {
  switch (column.type) {
    case recording::Column::Type::kReal:
      return values(column, column.reals, rows);
    case recording::Column::Type::kInteger:
      return values(column, column.integers, rows);
    case recording::Column::Type::kUnsigned:
      return values(column, column.unsigneds, rows);
    case recording::Column::Type::kText:
      break;
  }
  py::list texts;
  for (std::size_t row = 0; row < rows; ++row) {
    py::list cell;
    for (std::size_t i = column.begin(row); i < column.begin(row) + column.size(row); ++i)
      cell.append(column.texts[i]);
    texts.append(column.is_array || py::len(cell) != 1 ? py::object(cell) : py::object(cell[0]));
  }
  return texts;
}

/** An MCAP file. */
class Recording {
 public:
  explicit Recording(const std::string& path) : reader_(path) {}

  std::map<std::string, std::string> topics() const {
    std::map<std::string, std::string> topics;
    for (const auto& [id, channel] : reader_.channels()) {
      const auto schema = reader_.schemas().find(channel.schema);
      topics[channel.topic] = schema == reader_.schemas().end() ? "" : schema->second.name;
    }
    return topics;
  }

  py::dict table(const std::string& topic) {
    const recording::Schema* schema = nullptr;
    std::string known;
    for (const auto& [id, channel] : reader_.channels()) {
      known += (known.empty() ? "" : ", ") + channel.topic;
      if (channel.topic == topic && reader_.schemas().contains(channel.schema))
        schema = &reader_.schemas().at(channel.schema);
    }
    if (schema == nullptr)
      throw py::key_error("topic: found '" + topic + "', expected one of " +
                          (known.empty() ? "none: the recording is empty" : known));
    recording::Table table(topic, *schema);
    {
      const py::gil_scoped_release released;
      reader_.forEach({[&](const recording::Channel& channel) { return channel.topic == topic; }},
                      [&](const recording::Channel&, const recording::Message& message) {
                        table.add(message);
                        return true;
                      });
    }
    py::dict result;
    result["log_time_ns"] = py::array_t<std::uint64_t>(static_cast<py::ssize_t>(table.rows()), table.log_times.data());
    result["publish_time_ns"] =
        py::array_t<std::uint64_t>(static_cast<py::ssize_t>(table.rows()), table.publish_times.data());
    for (const recording::Column& column : table.columns)
      result[py::str(column.name)] = valuesOf(column, table.rows());
    return result;
  }

  std::map<std::string, std::string> attachments() {
    std::map<std::string, std::string> files;
    for (std::size_t i = 0; i < reader_.attachments().size(); ++i)
      files[reader_.attachments()[i].name] = reader_.attachmentData(i);
    return files;
  }

  const recording::Reader& reader() const { return reader_; }

 private:
  recording::Reader reader_;
};

}  // namespace

void bindRecording(py::module_& module) {
  using namespace py::literals;
  py::register_exception<recording::Error>(module, "RecordingError", PyExc_ValueError).attr("__doc__") =
      "The file is not a recording, or cannot be read.";
  py::class_<Recording>(module, "Recording", "An MCAP file, as `tandem record` and the black box write them.")
      .def(py::init<const std::string&>(), "path"_a)
      .def_property_readonly("topics", &Recording::topics, "Message type by the name of the topic.")
      .def_property_readonly(
          "message_count", [](const Recording& r) { return r.reader().statistics().messages; },
          "Messages of all topics.")
      .def_property_readonly(
          "finished", [](const Recording& r) { return r.reader().finished(); },
          "True: the file was closed by its writer.")
      .def_property_readonly(
          "damage", [](const Recording& r) { return r.reader().damage(); }, "Damage found in the file, as texts.")
      .def_property_readonly("attachments", &Recording::attachments,
                             "Texts of robot.yaml, deployment.yaml ... by name.")
      .def_property_readonly(
          "metadata",
          [](const Recording& r) {
            std::map<std::string, std::map<std::string, std::string>> all;
            for (const recording::Metadata& metadata : r.reader().metadata())
              all[metadata.name] = metadata.values;
            return all;
          },
          "Name and value pairs of each metadata record.")
      .def("__getitem__", &Recording::table, "topic"_a,
           "Messages of a topic as a dict of numpy arrays, one row per message, SI units; nested members with dots.");
}

}  // namespace tandem::python
