//! probe
use medial::complex; use medial::surface;use medial::geometry::TriangleBvh;
fn main(){
 let a:Vec<String>=std::env::args().collect();
 let l=complex::read(&a[1]).unwrap();
 let u=complex::MedialUnion::new(&l.mesh).unwrap();
 let (lo,hi)=u.bounding_box(); let diag=(hi-lo).length();
 let betti=medial::metrics::union_betti(&l.mesh,0.004*diag).unwrap();
 for tol in a[2..].iter().map(|e|e.parse::<f64>().unwrap()){
 let t=std::time::Instant::now();
 let s=match complex::union_surface(&l.mesh,tol*diag){Ok(s)=>s,Err(e)=>{println!("{e}");continue}};
 let t=t.elapsed().as_secs_f64();
 let m=&s.mesh;
 let f:Vec<_>=m.faces.iter().map(|f|{let [p,q,r]=f.map(|v|m.vertices[v as usize]);(p+q+r)/3.0}).collect();
 let mx=|v:Vec<f64>|v.iter().fold(0.0,|a:f64,b|a.max(b.abs()))/diag;
 let dv=mx(u.signed_batch(&m.vertices)); let df=mx(u.signed_batch(&f));
 let mut amin=vec![0usize;3];
 for face in &m.faces{let [p,q,r]=face.map(|v|m.vertices[v as usize]);let g=|a:medial::Vec3,b:medial::Vec3|a.dot(b).clamp(-1e300,1e300)/(a.length()*b.length());let an=[g(q-p,r-p),g(r-q,p-q),g(p-r,q-r)].map(|c|c.clamp(-1.,1.).acos().to_degrees());let k=an.iter().cloned().fold(180.,f64::min);if k<1.{amin[0]+=1}if k<10.{amin[1]+=1}if k<20.{amin[2]+=1}}
 let _=TriangleBvh::new(m).unwrap();
 println!("{} tol {tol} V {} F {} tets {} lost {} t {t:.2} vert {dv:.1e} face {df:.2e} angles<1,10,20 {:?} betti {betti:?}",a[1],m.vertices.len(),m.faces.len(),s.tetrahedra,s.lost,amin);
 match surface::validate(m){Ok(r)=>println!("  ok comps {} genus {:?} betti {:?} selfint {} degenerate {}",r.components,r.genus,r.expected_betti,r.intersecting_pairs,r.degenerate_faces),Err(e)=>println!("  err {e}")}
 }
}
