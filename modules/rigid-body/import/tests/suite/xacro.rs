//! xacro goes through the Python package of that name; where that is missing, the error explains how to get it.

use std::path::PathBuf;
use std::process::Command;
use terraglue_robot_import::{Options, read_robot};

const ARM: &str = r#"<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="mass" value="2.5"/>
  <xacro:include filename="$(find parts)/part.xacro"/>
  <xacro:part name="base"/>
  <xacro:part name="hand"/>
  <xacro:unless value="${mass > 3}">
    <joint name="wrist" type="continuous"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/></joint>
  </xacro:unless>
</robot>"#;

const PART: &str = r#"<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="part" params="name">
    <link name="${name}"><inertial><mass value="${2*mass}"/>
      <inertia ixx="${mass*0.01}" ixy="0" ixz="0" iyy="${mass*0.01}" iyz="0" izz="${mass*0.01}"/></inertial></link>
  </xacro:macro>
</robot>"#;

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("xacro").join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Whether the interpreter that the reader takes has the package.
fn has_package() -> bool {
    let named = std::env::var_os("VIRTUAL_ENV").map(|f| PathBuf::from(f).join("bin/python"));
    let python = named.unwrap_or_else(|| "python3".into());
    Command::new(python).args(["-c", "import xacro"]).output().is_ok_and(|o| o.status.success())
}

#[test]
fn a_file_is_expanded_where_the_package_is_there_and_told_how_to_get_it_otherwise() {
    let (arm, parts) = (folder("arm").join("arm.urdf.xacro"), folder("elsewhere"));
    std::fs::write(&arm, ARM).unwrap();
    std::fs::write(parts.join("part.xacro"), PART).unwrap();
    let options = Options { packages: vec![("parts".into(), parts)], ..Options::default() };
    let read = read_robot(&arm, &options);
    if !has_package() {
        let message = read.unwrap_err().to_string();
        assert!(message.contains("arm.urdf.xacro") && message.contains("pip install xacro"), "{message}");
        return;
    }
    let robot = read.unwrap();
    assert_eq!(robot.bodies.iter().map(|b| b.mass).collect::<Vec<_>>(), [5.0, 5.0]);
    assert_eq!(robot.joints[0].name, "wrist");
    // Without the package the error gives its name, and how to set it.
    let message = read_robot(&arm, &Options::default()).unwrap_err().to_string();
    assert!(message.contains("no package parts") && message.contains("packages = { parts ="), "{message}");
    // An error in the expanded text has a line there.
    let wrong = folder("arm").join("wrong.xacro");
    std::fs::write(&wrong, ARM.replace("value=\"2.5\"", "value=\"-1\"")).unwrap();
    let message = read_robot(&wrong, &options).unwrap_err().to_string();
    assert!(message.contains("wrong.xacro (expanded by xacro):"), "{message}");
    let broken = folder("arm").join("broken.xacro");
    std::fs::write(&broken, ARM.replace("${mass > 3}", "${nothing}")).unwrap();
    let message = read_robot(&broken, &options).unwrap_err().to_string();
    assert!(message.contains("xacro says:") && message.contains("nothing"), "{message}");
}

/// A file without any xacro in it asks for no Python, whatever its name.
#[test]
fn plain_urdf_is_read_as_it_is() {
    let file = folder("plain").join("plain.urdf.xacro");
    std::fs::write(
        &file,
        PART.replace("${name}", "a")
            .replace("${2*mass}", "1")
            .replace("${mass*0.01}", "1")
            .replace("<xacro:macro name=\"part\" params=\"name\">", "")
            .replace("</xacro:macro>", "")
            .replace("<robot ", "<robot name=\"r\" "),
    )
    .unwrap();
    assert_eq!(read_robot(&file, &Options::default()).unwrap().bodies[0].mass, 1.0);
}
