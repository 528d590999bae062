# ruff: noqa: E501
"""The panel in other languages; the source is English.

Each row: English, German, Spanish, French, Japanese. Units and names of instruments stay.
"""

from __future__ import annotations

import bpy

from ..settings.scene_settings import SETTINGS

LANGUAGES = ("de", "es", "fr", "ja")
"""Blender takes the language where it has none for the country."""
_LABELS = """
Underwater | Unterwasser | Bajo el agua | Sous l’eau | 水中
Add Water | Wasser einfüllen | Añadir agua | Ajouter de l’eau | 水を追加
Remove Water | Wasser entfernen | Quitar el agua | Retirer l’eau | 水を除去
Refresh Water | Wasser erneuern | Renovar el agua | Actualiser l’eau | 水を更新
Show the Water | Wasser zeigen | Mostrar el agua | Montrer l’eau | 水を表示
Submerge Scene | Szene versenken | Sumergir la escena | Immerger la scène | シーンを沈める
Use for New Files | Für neue Dateien verwenden | Usar para archivos nuevos | Utiliser pour les nouveaux fichiers | 新規ファイルに使用
Add Example | Beispiel einfügen | Añadir ejemplo | Ajouter un exemple | 例を追加
Reef | Riff | Arrecife | Récif | サンゴ礁
Wreck | Wrack | Pecio | Épave | 沈没船
Cave | Höhle | Cueva | Grotte | 洞窟
Pool Test Tank | Versuchsbecken | Tanque de pruebas | Bassin d’essai | 試験水槽
Looks | Stimmungen | Aspectos | Ambiances | ルック
Water | Wasser | Agua | Eau | 水
Depth and Floor | Tiefe und Grund | Profundidad y fondo | Profondeur et fond | 深さと海底
Surface and Waves | Oberfläche und Wellen | Superficie y olas | Surface et vagues | 水面と波
Snow and Bubbles | Schnee und Blasen | Nieve y burbujas | Neige et bulles | 雪と泡
Seed | Startwert | Semilla | Graine | シード
Sun and Sky | Sonne und Himmel | Sol y cielo | Soleil et ciel | 太陽と空
Lamps | Lampen | Lámparas | Lampes | ランプ
Housing | Gehäuse | Carcasa | Caisson | ハウジング
Lens to port | Objektiv bis Scheibe | Del objetivo al puerto | De l’objectif au hublot | レンズからポートまで
Lens forward | Objektiv voraus | Objetivo hacia delante | Objectif en avant | レンズの前進
Made of | Aus | Material | Matière | 材質
Leans to | Neigt sich nach | Se inclina hacia | Penche vers | 傾く方向
Salinity | Salzgehalt | Salinidad | Salinité | 塩分
Raw file | Rohdatei | Archivo en bruto | Fichier brut | RAW ファイル
Full well | Sättigungsladung | Capacidad del pozo | Capacité du puits | 飽和電荷
Read noise | Ausleserauschen | Ruido de lectura | Bruit de lecture | 読み出しノイズ
Camera Sensor | Kamerasensor | Sensor de la cámara | Capteur de la caméra | カメラセンサー
Quality | Qualität | Calidad | Qualité | 品質
Read-outs | Ablesungen | Lecturas | Relevés | 測定値
Jerlov type | Jerlov-Typ | Tipo de Jerlov | Type de Jerlov | Jerlov 型
From constituents | Aus Inhaltsstoffen | Por constituyentes | Par constituants | 成分から
Filled with air | Mit Luft gefüllt | Lleno de aire | Rempli d’air | 空気入り
Indices against water | Brechzahlen gegen Wasser | Índices frente al agua | Indices par rapport à l’eau | 水に対する屈折率
Source | Quelle | Fuente | Source | 出典
Scattering × | Streuung × | Dispersión × | Diffusion × | 散乱 ×
Absorption × | Absorption × | Absorción × | Absorption × | 吸収 ×
Reflectance | Reflexionsgrad | Reflectancia | Réflectance | 反射率
Surface | Oberfläche | Superficie | Surface | 水面
Light | Licht | Luz | Lumière | 光
Grab the Sun | Sonne greifen | Agarrar el sol | Saisir le soleil | 太陽をつかむ
White balance | Weißabgleich | Balance de blancos | Balance des blancs | ホワイトバランス
Exposure | Belichtung | Exposición | Exposition | 露出
By the light | Nach dem Licht | Por la luz | Selon la lumière | 光による
By the picture | Nach dem Bild | Por la imagen | Selon l’image | 画面による
By hand | Von Hand | A mano | À la main | 手動
Tone | Tonwertkurve | Curva tonal | Courbe tonale | トーンカーブ
Contrast | Kontrast | Contraste | Contraste | コントラスト
Real-time | Echtzeit | Tiempo real | Temps réel | リアルタイム
Bands | Bänder | Bandas | Bandes | バンド
Reference | Referenz | Referencia | Référence | 基準
Error ΔE | Fehler ΔE | Error ΔE | Erreur ΔE | 誤差 ΔE
Folder | Ordner | Carpeta | Dossier | フォルダー
Whole animation | Ganze Animation | Toda la animación | Toute l’animation | アニメーション全体
Render Reference | Referenz rendern | Renderizar referencia | Rendre la référence | 基準をレンダー
Continue | Fortsetzen | Continuar | Continuer | 続行
Denoise | Entrauschen | Reducir ruido | Débruiter | ノイズ除去
Noise | Rauschen | Ruido | Bruit | ノイズ
Visibility | Sichtweite | Visibilidad | Visibilité | 視程
Colour | Farbe | Color | Couleur | 色
Colour error | Farbfehler | Error de color | Erreur de couleur | 色誤差
Computing… | Wird berechnet … | Calculando… | Calcul en cours… | 計算中…
Essentials | Das Wichtigste | Lo esencial | L’essentiel | 基本
Render | Rendern | Renderizar | Rendu | レンダー
Advanced | Erweitert | Avanzado | Avancé | 詳細
Concentration | Konzentration | Concentración | Concentration | 濃度
Chlorophyll | Chlorophyll | Clorofila | Chlorophylle | クロロフィル
Minerals | Minerale | Minerales | Minéraux | 鉱物
Mixed with | Gemischt mit | Mezclada con | Mélangée avec | 混合
Fraction | Anteil | Fracción | Fraction | 割合
Floor | Grund | Fondo | Fond | 海底
Endless seabed | Endloser Meeresgrund | Fondo marino sin fin | Fond marin sans fin | 果てしない海底
Wind | Wind | Viento | Vent | 風
Caustics | Kaustiken | Cáusticas | Caustiques | コースティクス
Speed | Tempo | Velocidad | Vitesse | 速度
Loop | Schleife | Bucle | Boucle | ループ
Marine snow | Meeresschnee | Nieve marina | Neige marine | マリンスノー
Plankton | Plankton | Plancton | Plancton | プランクトン
Scatter Objects | Objekte verstreuen | Esparcir objetos | Disperser des objets | オブジェクトを散布
Corals | Korallen | Corales | Coraux | サンゴ
Rocks | Steine | Rocas | Rochers | 岩
Meadow | Wiese | Pradera | Herbier | 藻場
School of Fish | Fischschwarm | Banco de peces | Banc de poissons | 魚の群れ
As | Als | Como | Comme | 種類
Collection | Sammlung | Colección | Collection | コレクション
Bubbles | Blasen | Burbujas | Bulles | 泡
Silt | Schlick | Limo | Limon | 沈泥
Drift | Strömung | Corriente | Courant | 流れ
Sun zenith | Sonnenzenit | Cenit del sol | Zénith du soleil | 太陽天頂角
Sun azimuth | Sonnenazimut | Acimut del sol | Azimut du soleil | 太陽方位角
Sun Elevation | Sonnenhöhe | Altura del sol | Hauteur du soleil | 太陽高度
Sun From | Sonne aus | Sol desde | Soleil depuis | 太陽の方角
Sky | Himmel | Cielo | Ciel | 空
Daylight | Tageslicht | Luz del día | Lumière du jour | 昼光
Camera | Kamera | Cámara | Caméra | カメラ
Brighter | Heller | Más claro | Plus clair | 明るく
Samples | Abtastungen | Muestras | Échantillons | サンプル
Layers | Ebenen | Capas | Couches | レイヤー
Shafts of light | Lichtstrahlen | Rayos de luz | Rayons de lumière | 光芒
Planar reflections | Gespiegelte Dinge | Objetos reflejados | Objets reflétés | 映り込む物
Waves with height | Wellen mit Höhe | Olas con altura | Vagues avec hauteur | 高さのある波
Swell | Dünung | Mar de fondo | Houle | うねり
Swell length | Länge der Dünung | Longitud del mar de fondo | Longueur de la houle | うねりの波長
Whitecaps | Schaumkronen | Borreguillos | Moutons | 白波
Fetch | Windweg | Alcance del viento | Fetch | 吹送距離
Wind to | Wind nach | Viento hacia | Vent vers | 風の行き先
Swell to | Dünung nach | Mar de fondo hacia | Houle vers | うねりの行き先
Drift to | Strömung nach | Corriente hacia | Courant vers | 流れの行き先
Resolution | Auflösung | Resolución | Résolution | 解像度
Snow of the water | Schnee des Wassers | Nieve del agua | Neige de l’eau | 水自身のマリンスノー
Add Lamps | Lampen hinzufügen | Añadir lámparas | Ajouter des lampes | ランプを追加
Add Cloud | Wolke hinzufügen | Añadir nube | Ajouter un nuage | 濁りの雲を追加
Add Bubble Plumes | Blasenfahnen hinzufügen | Añadir columnas de burbujas | Ajouter des panaches de bulles | 気泡の群れを追加
Cloud of | Wolke aus | Nube de | Nuage de | 雲の成分
No Cloud | Keine Wolke | Ninguna nube | Aucun nuage | 雲なし
Phytoplankton | Phytoplankton | Fitoplancton | Phytoplancton | 植物プランクトン
Refractive index | Brechungsindex | Índice de refracción | Indice de réfraction | 屈折率
Radius | Radius | Radio | Rayon | 半径
Thickness | Dicke | Grosor | Épaisseur | 厚さ
Tilt | Neigung | Inclinación | Inclinaison | 傾き
Lens | Objektiv | Objetivo | Objectif | レンズ
Temperature | Temperatur | Temperatura | Température | 温度
Filter | Filter | Filtro | Filtre | フィルター
Diffuse shadows | Diffuse Schatten | Sombras difusas | Ombres diffuses | 拡散シャドウ
Reset Section | Abschnitt zurücksetzen | Restablecer sección | Réinitialiser la section | セクションをリセット
"""


def rows() -> list[tuple[str, ...]]:
    """Return every label with its translations."""
    return [tuple(cell.strip() for cell in line.split("|")) for line in _LABELS.split("\n") if line]


def catalogue() -> dict[str, dict[tuple[str, str], str]]:
    """Return what Blender registers: by language and message, for plain words and buttons."""
    return {
        language: {
            (context, name): row[place] + name.removeprefix(row[0])
            for row in rows()
            for name in (row[0], *_with_unit(row[0]))
            for context in ("*", "Operator")
        }
        for place, language in enumerate(LANGUAGES, start=1)
    }


def _with_unit(label: str) -> list[str]:
    """Return a label as it stands before a number that has a unit."""
    rows = (setting for setting in SETTINGS.values() if setting.label == label)
    return [f"{label} ({setting.unit})" for setting in rows if setting.unit]


def register() -> None:
    """Register the translations."""
    bpy.app.translations.register(__name__, catalogue())


def unregister() -> None:
    """Take them back."""
    bpy.app.translations.unregister(__name__)
