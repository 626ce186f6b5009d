//! Every row of a `frames.csv`, read back as it was written: writing what was read gives the same
//! bytes.

use std::path::Path;

use csv::StringRecord;

use crate::error::{Error, Result};
use crate::timing::records::{FRAME_COLUMNS, FRAMES_FILE, FrameRow};

type Told<T> = std::result::Result<T, String>;

/// Names of the passes and all rows, warm-up included, of the text of a `frames.csv`; `path` is for
/// messages, which name the line.
pub fn read_rows(text: &str, path: &Path) -> Result<(Vec<String>, Vec<FrameRow>)> {
    let failed = |cause: csv::Error| Error::io(path, cause);
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().map_err(failed)?.clone();
    let passes = passes(&header).ok_or_else(|| {
        Error::io(
            path,
            format!(
                "no {FRAMES_FILE} of this nimbus: it has other columns; results of another version?"
            ),
        )
    })?;
    let mut rows = Vec::new();
    for line in reader.records() {
        let line = line.map_err(failed)?;
        let at = line.position().map_or(0, csv::Position::line);
        rows.push(
            row(&line, passes.len())
                .map_err(|what| Error::io(path, format!("line {at}: {what}")))?,
        );
    }
    Ok((passes, rows))
}

/// None where the columns are others.
fn passes(header: &StringRecord) -> Option<Vec<String>> {
    let n_passes = header.len().checked_sub(FRAME_COLUMNS.len() + 1)?;
    let is_ours = header.iter().zip(FRAME_COLUMNS).all(|(found, expected)| found == expected);
    if !is_ours || header.get(header.len() - 1) != Some("image_hash") {
        return None;
    }
    let pass = |field: &str| Some(field.strip_prefix("gpu_")?.strip_suffix("_ms")?.to_owned());
    header.iter().skip(FRAME_COLUMNS.len()).take(n_passes).map(pass).collect()
}

/// A line of as many fields as the header.
fn row(line: &StringRecord, n_passes: usize) -> Told<FrameRow> {
    let field = |name: &str| {
        let i = FRAME_COLUMNS.iter().position(|column| *column == name);
        i.and_then(|i| line.get(i)).ok_or_else(|| format!("no {name}"))
    };
    let text = |name: &str| field(name).map(str::to_owned);
    let flag = |name: &str| match field(name)? {
        "true" => Ok(true),
        "false" => Ok(false),
        other => Err(odd(name, "true or false", other)),
    };
    let count = |name: &str| {
        field(name)?.parse::<u32>().map_err(|_| odd(name, "a number", field(name).unwrap_or("")))
    };
    let ms = |name: &str| time(name, field(name)?);
    // What is empty was not finite.
    let or_nan = |name: &str| ms(name).map(|value| value.unwrap_or(f64::NAN));
    let pass_ms =
        line.iter().skip(FRAME_COLUMNS.len()).take(n_passes).map(|field| time("a pass", field));
    let hash = line.iter().next_back().unwrap_or_default();
    Ok(FrameRow {
        phase: text("phase")?,
        sweep: text("sweep")?,
        threading: text("threading")?,
        skip: flag("skip")?,
        block: count("block")? as usize,
        frame: count("frame")?,
        time_s: or_nan("time_s")?,
        warm_up: flag("warm_up")?,
        frame_ms: or_nan("frame_ms")?,
        game_ms: or_nan("game_ms")?,
        record_ms: or_nan("record_ms")?,
        submit_ms: or_nan("submit_ms")?,
        wait_ms: or_nan("wait_ms")?,
        gpu_ms: ms("gpu_ms")?,
        latency_ms: or_nan("latency_ms")?,
        queue_depth: count("queue_depth")? as usize,
        n_drawn: count("n_drawn")?,
        ran: text("ran")?,
        pass_ms: pass_ms.collect::<Told<_>>()?,
        image_hash: (!hash.is_empty()).then(|| hash.to_owned()),
    })
}

fn time(name: &str, field: &str) -> Told<Option<f64>> {
    match field {
        "" => Ok(None),
        text => text
            .parse::<f64>()
            .ok()
            .filter(|v| v.is_finite())
            .map(Some)
            .ok_or_else(|| odd(name, "a time", text)),
    }
}

fn odd(name: &str, expected: &str, found: &str) -> String {
    format!("{name}: expected {expected}, found \"{found}\"")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::records::write_frames;

    const HEADER: &str = "i_row,phase,sweep,threading,skip,block,frame,time_s,warm_up,frame_ms,game_ms,record_ms,submit_ms,wait_ms,\
                          gpu_ms,latency_ms,queue_depth,n_drawn,ran,gpu_sort_ms,gpu_first_ms,image_hash\n";
    const ROWS: &str = "0,dense,\"a=1, \
        b=2\",serial,true,0,0,0,true,16.123456789012344,1,0.5,0.25,14.5,,,1,7,sort+sprites,1.5,,\n\
                        1,,,parallel,false,3,4000000000,-0.1,false,0.1,1e-9,,0,3,7.25,1,0,0,,,0.3,0abc\n";

    fn read(text: &str) -> Result<(Vec<String>, Vec<FrameRow>)> {
        read_rows(text, Path::new("frames.csv"))
    }

    #[test]
    fn what_is_read_is_written_as_it_was() {
        let text = format!("{HEADER}{ROWS}").replace("1e-9", "0.000000001");
        let (passes, rows) = read(&text).unwrap();
        assert_eq!(passes, ["sort", "first"]);
        assert!(
            rows[0].latency_ms.is_nan() && rows[0].gpu_ms.is_none() && rows[1].record_ms.is_nan()
        );
        assert_eq!((rows[1].frame, rows[1].image_hash.as_deref()), (4_000_000_000, Some("0abc")));
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("again.csv");
        write_frames(&path, &passes, &rows).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }

    #[test]
    fn what_is_no_row_is_named_with_its_line() {
        for (from, to, expected) in [
            ("i_row", "row", "other columns"),
            ("image_hash", "hash", "other columns"),
            ("gpu_sort_ms", "sort", "other columns"),
            (
                ",serial,true",
                ",serial,maybe",
                "line 2: skip: expected true or false, found \"maybe\"",
            ),
            ("4000000000", "-1", "line 3: frame: expected a number"),
            (",0.3,0abc", ",NaN,0abc", "line 3: a pass: expected a time"),
            (",0.3,0abc", ",0.3", "record 2"),
        ] {
            let text = format!("{HEADER}{ROWS}");
            assert!(text.contains(from), "{from}");
            let said = read(&text.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(said.contains(expected), "{said}");
        }
        assert!(read("").is_err());
    }
}
