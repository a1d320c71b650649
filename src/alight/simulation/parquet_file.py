"""Recordings as Parquet: one float64 column for each scalar signal."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from alight.files import FileError, file_to_read, whole_file
from alight.simulation.recording import Recording
from alight.simulation.recording_description import (
    KEY,
    TIME,
    Description,
    description_of,
    names_and_numbers,
)


def save_parquet(recording: Recording, path: str | Path) -> None:
    """Save a recording as a Parquet file that pandas, Polars and DuckDB read.

    The columns are ``t`` and every scalar signal by name. Each carries its ``unit`` and
    ``meaning``; verdict, layout and scenario stand as JSON in the file's metadata under
    ``alight``. Numbers are kept to the bit.

    Parameters
    ----------
    recording : Recording
        What to save.
    path : str or Path
        Where; an older file there is replaced once the new one is complete.

    Raises
    ------
    FileError
        If the file cannot be written.
    AlightError
        If two columns bear the same name, or the scenario is not plain data.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    names, numbers = names_and_numbers(recording)
    signals = [TIME, *(s for s in recording.layout.signals.values() for _ in range(s.size))]
    fields = [
        pa.field(name, pa.float64(), False, {"unit": signal.unit, "meaning": signal.meaning})
        for name, signal in zip(names, signals, strict=True)
    ]
    schema = pa.schema(fields, {KEY: description_of(recording)})
    columns = [pa.array(column) for column in np.ascontiguousarray(numbers.T)]
    with whole_file(path) as file:
        pq.write_table(
            pa.Table.from_arrays(columns, schema=schema),
            file,
            compression="zstd",
            # Numbers that hardly repeat gain nothing from a dictionary; with their bytes split,
            # the slowly changing ones stand together and pack to two thirds of the size.
            use_dictionary=False,
            use_byte_stream_split=True,
            write_page_checksum=True,
        )


def load_parquet(path: str | Path) -> Recording:
    """Load a recording that `save_parquet` saved.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    FileError
        If the file cannot be read, is damaged, or holds no recording of Alight.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = Path(path)
    with file_to_read(path, "a Parquet file") as file:
        parquet = pq.ParquetFile(file, page_checksum_verification=True)
        metadata = parquet.schema_arrow.metadata or {}
        if KEY.encode() not in metadata:
            raise FileError(path, f"is no recording: its metadata has no entry {KEY!r}")
        description = Description.read(metadata[KEY.encode()], path)
        expected = [(name, pa.float64()) for name in description.names]
        found = [(field.name, field.type) for field in parquet.schema_arrow]
        if found != expected:
            raise FileError(path, f"its columns are {_listed(found)}, not {_listed(expected)}")
        columns = [column.to_numpy() for column in parquet.read().columns]
        return description.recording(np.column_stack(columns), path)


def _listed(columns: list[tuple[str, object]]) -> str:
    return ", ".join(f"{name} ({kind})" for name, kind in columns)
