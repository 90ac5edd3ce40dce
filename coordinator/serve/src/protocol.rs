//! The Foxglove WebSocket protocol (`foxglove.websocket.v1`, and `foxglove.sdk.v1`, which is the same): texts are JSON with
//! `op`, binary messages begin with a byte for their kind. All numbers are little-endian.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::Deserialize;
use serde_json::{Value, json};
use terraglue_recording::{Stored, TopicInfo};

/// Names under which clients ask for it.
pub const SUBPROTOCOLS: [&str; 2] = ["foxglove.websocket.v1", "foxglove.sdk.v1"];

/// Content of the first message to every client.
#[derive(Clone, Default)]
pub struct Welcome {
    /// Name of the run.
    pub name: String,
    /// Number of this server; another one means that all is to be asked again. The server sets it.
    pub session: String,
    /// Name of the recording that is shown beside the run.
    pub beside: Option<String>,
    /// `[page]` of the scenario: how the page looks at first.
    pub page: Option<Value>,
}

/// A text of a client.
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub enum ClientText {
    /// Wants messages.
    Subscribe { subscriptions: Vec<Subscription> },
    /// Wants them no more.
    Unsubscribe { subscription_ids: Vec<u32> },
    /// Wants values of variables.
    GetParameters {
        #[serde(default)]
        parameter_names: Vec<String>,
        id: Option<String>,
    },
    /// Writes variables.
    SetParameters { parameters: Vec<Parameter>, id: Option<String> },
    /// Wants changes of values.
    SubscribeParameterUpdates {
        #[serde(default)]
        parameter_names: Vec<String>,
    },
    /// Wants them no more.
    UnsubscribeParameterUpdates {
        #[serde(default)]
        parameter_names: Vec<String>,
    },
    /// Wants a file.
    FetchAsset { uri: String, request_id: u32 },
    /// Has topics of its own.
    Advertise {},
    /// And no more.
    Unadvertise {},
    /// Who talks with whom.
    SubscribeConnectionGraph {},
    /// And no more.
    UnsubscribeConnectionGraph {},
}

/// A subscription with the number that the client gives it.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Subscription {
    /// Number of the client.
    pub id: u32,
    /// Number of the channel.
    pub channel_id: u64,
}

/// A variable with a value.
#[derive(Debug, Deserialize)]
pub struct Parameter {
    /// Full name.
    pub name: String,
    /// The value to set.
    #[serde(default)]
    pub value: Value,
}

/// A service call: number of the service, number of the call, and the request.
pub struct Call<'a> {
    /// Of the service.
    pub service: u32,
    /// Of the call.
    pub call: u32,
    /// How the request is written.
    pub encoding: &'a str,
    /// The request.
    pub request: &'a [u8],
}

/// A binary message of a client; the reason where it is none that is known.
///
/// # Errors
/// It is cut off, or of a kind that is not taken.
pub fn call(bytes: &[u8]) -> Result<Call<'_>, String> {
    let number = |k: usize| {
        let four = bytes.get(k..k + 4).and_then(|b| b.try_into().ok());
        four.map(u32::from_le_bytes).ok_or("a binary message is cut off")
    };
    match bytes.first() {
        Some(2) => {
            let length = number(9)? as usize;
            let end = 13_usize.checked_add(length).filter(|end| *end <= bytes.len());
            let end = end.ok_or("the encoding of a service call is cut off")?;
            let encoding = std::str::from_utf8(&bytes[13..end])
                .map_err(|_| "the encoding of a service call is no text")?;
            Ok(Call { service: number(1)?, call: number(5)?, encoding, request: &bytes[end..] })
        }
        Some(1) => Err("this server takes no messages of clients".into()),
        Some(other) => Err(format!("binary messages of kind {other} are not known")),
        None => Err("an empty binary message".into()),
    }
}

/// The first message to a client.
pub fn server_info(welcome: &Welcome) -> Value {
    let mut metadata = json!({ "terraglue": env!("CARGO_PKG_VERSION") });
    // the protocol has texts here
    if let Some(beside) = &welcome.beside {
        metadata["beside"] = beside.as_str().into();
    }
    if let Some(page) = &welcome.page {
        metadata["page"] = page.to_string().into();
    }
    json!({
        "op": "serverInfo",
        "name": welcome.name,
        "capabilities": ["parameters", "parametersSubscribe", "services", "time"],
        "supportedEncodings": ["json"],
        "metadata": metadata,
        "sessionId": welcome.session,
    })
}

/// Announces topics.
pub fn advertise(topics: &[TopicInfo]) -> Value {
    let one = |t: &TopicInfo| {
        let schema = match t.schema_encoding.as_str() {
            "protobuf" => BASE64_STANDARD.encode(&t.schema_data),
            _ => String::from_utf8_lossy(&t.schema_data).into_owned(),
        };
        json!({
            "id": t.channel,
            "topic": t.topic,
            "encoding": t.encoding,
            "schemaName": t.schema,
            "schema": schema,
            "schemaEncoding": if t.schema_encoding.is_empty() { "jsonschema" } else { &t.schema_encoding },
        })
    };
    json!({ "op": "advertise", "channels": topics.iter().map(one).collect::<Vec<_>>() })
}

/// Announces services, numbered from 1.
pub fn advertise_services(names: &[String]) -> Value {
    let one = |(k, name): (usize, &String)| {
        let schema = |part: &str| json!({ "encoding": "json", "schemaName": format!("{name}.{part}"), "schemaEncoding": "jsonschema", "schema": "{\"type\":\"object\"}" });
        json!({ "id": k + 1, "name": name, "type": name, "request": schema("Request"), "response": schema("Response") })
    };
    json!({ "op": "advertiseServices", "services": names.iter().enumerate().map(one).collect::<Vec<_>>() })
}

/// Takes services back, numbered from 1.
pub fn unadvertise_services(count: usize) -> Value {
    json!({ "op": "unadvertiseServices", "serviceIds": (1..=count).collect::<Vec<_>>() })
}

/// Values of variables; with the number of whoever asked.
pub fn parameter_values(values: &[(String, Value)], id: Option<&str>) -> Value {
    let one = |(name, value): &(String, Value)| match value {
        // a client in JavaScript writes 0 for 0.0: the type distinguishes them
        Value::Number(n) if n.is_f64() => json!({ "name": name, "value": value, "type": "float64" }),
        _ => json!({ "name": name, "value": value }),
    };
    let mut message =
        json!({ "op": "parameterValues", "parameters": values.iter().map(one).collect::<Vec<_>>() });
    if let Some(id) = id {
        message["id"] = json!(id);
    }
    message
}

/// Something that a person should read; level 0: information, 1: warning, 2: error.
pub fn status(level: u8, message: &str) -> Value {
    json!({ "op": "status", "level": level, "message": message })
}

/// A call that was refused.
pub fn call_failure(service: u32, call: u32, message: &str) -> Value {
    json!({ "op": "serviceCallFailure", "serviceId": service, "callId": call, "message": message })
}

/// A message of a subscription.
pub fn message(subscription: u32, stored: &Stored) -> Vec<u8> {
    let mut out = Vec::with_capacity(13 + stored.data.len());
    out.push(1);
    out.extend(subscription.to_le_bytes());
    out.extend(stored.time_ns.to_le_bytes());
    out.extend(&stored.data);
    out
}

/// The simulated time.
pub fn time(time_ns: u64) -> Vec<u8> {
    let mut out = vec![2];
    out.extend(time_ns.to_le_bytes());
    out
}

/// The answer to a call, as JSON.
pub fn response(service: u32, call: u32, body: &Value) -> Vec<u8> {
    let mut out = vec![3];
    out.extend(service.to_le_bytes());
    out.extend(call.to_le_bytes());
    out.extend(4_u32.to_le_bytes());
    out.extend(b"json");
    out.extend(body.to_string().into_bytes());
    out
}

/// There is no such file.
pub fn no_asset(request: u32, message: &str) -> Vec<u8> {
    let mut out = vec![4];
    out.extend(request.to_le_bytes());
    out.push(1);
    out.extend((message.len() as u32).to_le_bytes());
    out.extend(message.as_bytes());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_is_read_and_one_that_is_cut_off_is_refused() {
        let mut bytes = vec![2];
        bytes.extend(7_u32.to_le_bytes());
        bytes.extend(9_u32.to_le_bytes());
        bytes.extend(4_u32.to_le_bytes());
        bytes.extend(b"json{}");
        let read = call(&bytes).map(|c| (c.service, c.call, c.encoding.to_owned(), c.request.to_vec()));
        assert_eq!(read, Ok((7, 9, "json".into(), b"{}".to_vec())));
        for length in 0..13 + 4 {
            assert!(call(&bytes[..length]).is_err(), "{length}");
        }
        bytes[9..13].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(call(&bytes).is_err());
        assert!(call(&[1, 2, 3]).is_err() && call(&[77]).is_err());
    }

    #[test]
    fn texts_of_clients_are_read() {
        let read = |text: &str| serde_json::from_str::<ClientText>(text);
        assert!(matches!(
            read(r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":2}]}"#),
            Ok(ClientText::Subscribe { subscriptions }) if subscriptions[0].channel_id == 2
        ));
        assert!(matches!(
            read(r#"{"op":"getParameters","parameterNames":[]}"#),
            Ok(ClientText::GetParameters { .. })
        ));
        assert!(read(r#"{"op":"nonsense"}"#).is_err());
        assert!(read("{").is_err());
    }
}
